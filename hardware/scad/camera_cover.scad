// Over the camera: carries the springs and the LED, and the stop screws reach into it. White, printed upside down;
// the first three layers above the LED are the diffuser.
include <common.scad>

post = camera_hole + 3;
room = 3;  // for parts on the board
skin = 1.7;  // of the ledge, which slopes at 45 degrees
overhang_most = max(overhang[0][0], overhang[0][1]);
z_foot = camera_barrel ? mount_thickness : z_board_top;
wire = [3, 2];  // the LED's two wires

module camera_cover() {
  difference() {
    outside();
    translate([0, 0, z_foot - 1]) cylinder(r = bore_radius, h = z_cover_top - z_foot + 2);
    if (camera_barrel) barrel_holder();
    else board_room();
    light();
    for (at = springs) hole(at, 2 * socket_radius, [z_cover_top - springs_socket, z_cover_top + 1]);
    for (s = stop_screws) stop_slot(s);
    for (at = bolts) hole(at, cover_thread_hole, [z_foot - 1, min(z_ledge, bolt_length + 1)]);
    if (target_layout == "mirror")
      for (at = holder_screws) hole(at, cover_thread_hole, [z_cover_top - 6, z_cover_top + 1]);
    first_layer_mark([mark_x(), 0], z_cover_top, true, 2.5);
    words();
  }
}

/// Away from the diffuser.
function mark_x() = (light_position[0][0] > 0 ? cover_from - bore_radius : cover_to + bore_radius) / 2;

module outside() {
  slab([cover_from, cover_to], [-cover_y_half, cover_y_half], [z_ledge - eps, z_cover_top], 0.8);
  if (overhang_most > 0)
    hull() {
      slab([cover_from, cover_to], [-cover_y_half, cover_y_half], [z_ledge - eps, z_ledge], 0.8);
      slab(foot_x, [-foot_y, foot_y], [z_foot, z_ledge - overhang_most], 0.8);
    }
  else
    slab([cover_from, cover_to], [-cover_y_half, cover_y_half], [z_foot, z_ledge], 0.8);
}

/// Over the parts on the board, around the posts that press on it.
module board_room() {
  top = min(z_board_top + room, z_ledge - skin);
  difference() {
    intersection() {
      hull() {
        box([cover_from + cover_wall, -cover_y_half + cover_wall, z_ledge - skin - eps],
            [cover_to - cover_wall, cover_y_half - cover_wall, z_ledge - skin]);
        box([foot_x[0] + cover_wall, -foot_y + cover_wall, z_board_top - 2],
            [foot_x[1] - cover_wall, foot_y - cover_wall, z_ledge - skin - overhang_most]);
      }
      box([-100, -100, z_board_top - 1], [100, 100, top]);
    }
    for (at = bolts) hole(at, post, [z_board_top - 2, z_ledge]);
  }
  // The LED's wires leave beside the camera's plug.
  box([foot_x[0] - 1, -wire[0] / 2, z_board_top - 1], [0, wire[0] / 2, z_board_top + wire[1]]);
}

/// Two screws clamp the barrel; its cable leaves below, towards -x.
module barrel_holder() {
  half = min(bore_radius, camera_lens_diameter / 2);
  box([cover_from - 1, -half, mount_thickness - 1], [0, half, z_board_bottom]);
  for (z = [0.3, 0.75])
    translate([cover_from - 1, 0, z_board_bottom + z * camera_thickness]) rotate([0, 90, 0])
      cylinder(d = stops_thread_hole, h = -cover_from + 1);
  // The LED's wires take the same way out.
  box([0, light_position[0][1] - wire[0] / 2, z_foot - 1],
      [light_position[0][0], light_position[0][1] + wire[0] / 2, z_foot + wire[1]]);
}

/// The LED goes in from below, up to the diffuser.
module light() {
  x = light_position[0][0];
  y = light_position[0][1];
  box([x - light_width / 2, y - light_width / 2, z_foot - 1],
      [x + light_width / 2, y + light_width / 2, z_cover_top - light_diffuser]);
}

module stop_slot(s) {
  across = stops_screw + 2 * (s[3] == 0 ? travel_y : travel_x);
  deep = s[4] + (s[3] == 0 ? travel_x : travel_y);
  high = stops_screw + 2 * travel_z;
  along_x = s[3] == 0;
  at_stop_screw(s) translate([0, 0, deep / 2 - 0.5])
    cube([along_x ? high : across, along_x ? across : high, deep + 1], center = true);
}

/// On the end towards +x.
module words() {
  if (!$bare)
    translate([cover_to - engraving, 0, (z_foot + z_cover_top) / 2]) rotate([90, 0, 90])
      linear_extrude(1, convexity = 8) text(name, size = fitting(name, 4, 2 * cover_y_half - 3), halign = "center", valign = "center", $fn = 8);
}
