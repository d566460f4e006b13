// The camera stands on four posts; ears to screw it down, or a round plate that covers the puck's base. Printed as it
// stands.
include <common.scad>

post = camera_hole + 3;
tongue = 10;
tongue_half = 6;
tie_y = 4.4;
base_screw = 3.4;
base_screw_radius = mount_width / 2 - 5;
rim_outer = top_knob_diameter / 2 + 3;

module mounting_plate() {
  difference() {
    union() {
      if (mount_puck) {
        cylinder(d = mount_width, h = mount_thickness, $fn = 90);
        // Keeps light and fingers out below the knob.
        translate([0, 0, mount_thickness - eps]) linear_extrude(z_shield_bottom_x - travel_z - 1 - mount_thickness, convexity = 8)
          difference() {
            circle(r = rim_outer, $fn = 90);
            circle(r = rim_outer - print_wall, $fn = 90);
          }
      } else {
        slab(foot_x, [-foot_y, foot_y], [0, mount_thickness]);
        ears();
        slab([foot_x[0] - tongue, foot_x[0] + 4], [-tongue_half, tongue_half], [0, mount_thickness]);
      }
      for (at = bolts) hole(at, post, [mount_thickness - eps, camera_barrel ? mount_thickness : z_board_bottom]);
    }
    for (at = bolts) {
      hole(at, camera_hole, [-1, z_board_top]);
      countersink(at, camera_hole, m2_head, 0, false);
    }
    if (mount_puck) puck_holes();
    else strain_relief();
    mark_x = mount_puck ? 12 : foot_x[1] - 8;
    first_layer_mark([mark_x, 0], 0, false, 4, name, mark_x - foot_x[0] - 6);
  }
}

module ears() {
  reach = mount_width / 2 - mount_hole / 2 - 3;
  linear_extrude(mount_thickness, convexity = 8) difference() {
    hull() for (y = [-1, 1]) translate([0, y * reach]) circle(r = mount_hole / 2 + 3);
    for (y = [-1, 1]) translate([0, y * reach]) circle(d = mount_hole);
  }
}

/// A tie through both slots and the groove underneath holds the camera's cable and the LED's wires on the tongue.
module strain_relief() {
  x = foot_x[0] - tongue / 2;
  for (y = [-tie_y, tie_y])
    box([x - tie[1] / 2, y - tie[0] / 2, -1], [x + tie[1] / 2, y + tie[0] / 2, mount_thickness + 1]);
  box([x - tie[1] / 2, -tie_y, -1], [x + tie[1] / 2, tie_y, 1.4]);
}

/// For the screws into the base, and the way down for the camera's plug and the LED's wires.
module puck_holes() {
  for (a = [45:90:315]) {
    at = base_screw_radius * [cos(a), sin(a)];
    hole(at, base_screw, [-1, mount_thickness + 1]);
    countersink(at, base_screw, 6.4, mount_thickness, true);
  }
  wide = camera_plug + 2;
  slab([-camera_width / 2 - 8, -camera_width / 2 + 4], [-wide / 2, wide / 2], [-1, mount_thickness + 1]);
}
