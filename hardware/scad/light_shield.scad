// The hood that keeps other light out, is what one pushes, and carries the tags and the stop screws. Printed upside
// down.
include <common.scad>
use <tag_roof.scad>

outer_from = inner_from - print_wall;
outer_to = inner_to + (four_walls ? print_wall : 0);
outer_y = inner_y + print_wall;
pad_half = 4.5;
lip = [1.2, 1.5];  // around the top plate: thickness, height

module light_shield() {
  difference() {
    union() {
      slab([outer_from, outer_to], [-outer_y, outer_y], [z_plate_top, z_top], 1);
      walls(z_shield_bottom_y) for (side = [-1, 1]) translate([0, side * (inner_y + 50)]) square([400, 100], center = true);
      walls(z_shield_bottom_x) for (x = [inner_from - 50, inner_to + 50]) translate([x, 0]) square([100, 400], center = true);
      for (s = stop_screws) pad(s);
      inside();
    }
    cuts();
  }
}

/// Down to z, where the outline lies within the children.
module walls(z) {
  translate([0, 0, z]) linear_extrude(z_top - 1 - z, convexity = 8) intersection() {
    outline();
    union() children();
  }
}

module outline() {
  difference() {
    plate2d([outer_from, outer_to], [-outer_y, outer_y], 1);
    translate([inner_from, -inner_y]) square([inner_to - inner_from + (four_walls ? 0 : 1), 2 * inner_y]);
  }
}

/// What is under the roof, the knob's too.
module inside() {
  tag_roof();
  half = plate_half[0] + print_clearance * [1, 1];
  room = [four_walls ? inner_to : 100, inner_y];
  translate([0, 0, z_plate_top - lip[1]]) linear_extrude(lip[1] + eps, convexity = 8) intersection() {
    difference() {
      plate2d([-half[0] - lip[0], half[0] + lip[0]], [-half[1] - lip[0], half[1] + lip[0]], 2);
      plate2d([-half[0], half[0]], [-half[1], half[1]], 2);
    }
    translate([inner_from - eps, -room[1] - eps]) square([room[0] - inner_from + 2 * eps, 2 * room[1] + 2 * eps]);
  }
}

/// Holes and marks, the knob's too.
module cuts() {
  for (at = top_screws) {
    hole(at, top_screw + 0.3, [z_plate_top - lip[1] - 1, z_top + 1]);
    countersink(at, top_screw + 0.3, m2_head, z_top, true);
  }
  load_holes();
  for (s = stop_screws) at_stop_screw(s) {
    translate([0, 0, -s[6] - 1]) cylinder(d = stops_thread_hole, h = s[6] + 1);
    if (top_knob) translate([0, 0, -s[6] - 100]) cylinder(d = m3_head_room, h = 100);
  }
  mark_x = min(outer_to - 4, top_screws[1][0] + 5);
  first_layer_mark([mark_x, -inner_y + 6], z_top, true, 4, name, mark_x - outer_from - 6);
}

/// So much plastic that the screw holds and its head sits where it should; its slope towards the bed is 45 degrees.
module pad(s) {
  gap = s[3] == 0 ? cover_from - inner_from : inner_y - cover_y_half;
  extra = s[6] - gap - print_wall;
  bottom = s[3] == 0 ? z_shield_bottom_x : z_shield_bottom_y;
  low = max(bottom - s[2], -pad_half);
  if (extra > 0) translate([0, 0, s[2]]) hull() {
    pad_box(s, gap + print_wall - 0.5, gap + print_wall, low, pad_half + extra);
    pad_box(s, gap + print_wall - 0.5, s[6], low, pad_half);
  }
}

module pad_box(s, from, to, low, high) {
  sign = s[s[3]] < 0 ? -1 : 1;
  face = abs(s[s[3]]);
  if (s[3] == 0)
    box([sign < 0 ? -face - to : face + from, s[1] - pad_half, low],
        [sign < 0 ? -face - from : face + to, s[1] + pad_half, high]);
  else
    box([s[0] - pad_half, sign < 0 ? -face - to : face + from, low],
        [s[0] + pad_half, sign < 0 ? -face - from : face + to, high]);
}
