// What the springs carry. Through its opening the camera sees the tags, which belong to the shield. Printed upside
// down.
include <common.scad>

module top_plate() {
  half = plate_half[0];
  difference() {
    slab([-half[0], half[0]], [-half[1], half[1]], [z_plate_bottom, z_plate_top], 2);
    slab([-window[0][0], window[0][0]], [-window[0][1], window[0][1]], [z_plate_bottom - 1, z_plate_top + 1], 0.5);
    for (at = springs) hole(at, 2 * socket_radius, [z_plate_bottom - 1, z_plate_bottom + springs_socket]);
    for (at = top_screws) hole(at, top_thread_hole, [z_plate_bottom - 1, z_plate_top + 1]);
    first_layer_mark([half[0] - 2.4, half[1] - 2.4], z_plate_top, true, 2.5);
  }
}
