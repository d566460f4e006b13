// What is bought, for pictures and for the test that nothing collides; not to be printed.
include <common.scad>
use <puck_base.scad>

module camera() {
  if (camera_barrel) {
    color("#303030") translate([0, 0, z_board_bottom]) cylinder(d = camera_width, h = z_lens_front - z_board_bottom);
    color("#202020") translate([0, 0, z_board_bottom - 1]) rotate([0, -90, 0]) cylinder(d = 3.6, h = 30);
  } else {
    color("#1c2a1c") difference() {
      slab([-camera_width / 2, camera_width / 2], [-camera_depth / 2, camera_depth / 2], [z_board_bottom, z_board_top], 1);
      for (at = bolts) hole(at, camera_hole, [z_board_bottom - 1, z_board_top + 1]);
    }
    color("#202020") {
      translate([0, 0, z_board_top - eps]) cylinder(d = camera_lens_diameter, h = 0.4 * camera_lens_height);
      translate([0, 0, z_board_top]) cylinder(d = 0.86 * camera_lens_diameter, h = camera_lens_height);
    }
    color("#6a4c93") translate([0, 0, z_lens_front - 0.9]) cylinder(d = 0.4 * camera_lens_diameter, h = 0.95);
    color("#eeeeee") box([-camera_width / 2, -camera_plug / 2, max(mount_thickness, z_board_bottom - 4) + 0.1],
                         [-camera_width / 2 + 6, camera_plug / 2, z_board_bottom]);
  }
}

module led() {
  x = light_position[0][0];
  y = light_position[0][1];
  z = z_cover_top - light_diffuser;
  color("#fff3b0") box([x - light_width / 2 + 0.2, y - light_width / 2 + 0.2, z - light_height],
                       [x + light_width / 2 - 0.2, y + light_width / 2 - 0.2, z]);
}

module bolts_below() {
  color("#c8c8c8") for (at = bolts) {
    hole(at, 2, [0, bolt_length]);
    translate([at[0], at[1], 0]) cylinder(d1 = 3.8, d2 = 2, h = 0.9);
  }
}

module roof_screws() {
  color("#c8c8c8") for (at = top_screws) {
    hole(at, top_screw, [z_plate_top - 4, z_top]);
    translate([at[0], at[1], z_top - 0.9]) cylinder(d1 = 2, d2 = 3.8, h = 0.9);
  }
}

module stop_screws_in() {
  color("#c8c8c8") for (s = stop_screws) at_stop_screw(s) {
    translate([0, 0, -s[6]]) cylinder(d = stops_screw, h = s[5]);
    translate([0, 0, -s[6] - 2]) cylinder(d = m3_head, h = 2);
  }
}

module tag_papers() {
  for (i = [0:len(tags) - 1]) at_tag(tags[i]) tag_paper(i);
}

/// As it is printed, in the frame of the tag.
module tag_paper(i) {
  color("white") box([-paper_half, -paper_half, 0], [paper_half, paper_half, paper_thickness]);
  color("black") box([-target_tag_size / 2, -target_tag_size / 2, -0.03], [target_tag_size / 2, target_tag_size / 2, 0.05]);
  color("white") white_cells(tag_bits[i]);
}

/// One below the other, enlarged, upright, as the camera sees them; the ids beside them.
module tags_enlarged(times) {
  for (i = [0:len(tags) - 1]) translate([0, (i - (len(tags) - 1) / 2) * 3 * times * paper_half, 0]) {
    scale(times) tag_paper(i);
    color("black") translate([1.3 * times * paper_half, 0, 0]) mirror([0, 1, 0])
      linear_extrude(0.1) text(str("id ", tag_ids[i]), size = 0.5 * times * paper_half, valign = "center", $fn = 8);
  }
}

module white_cells(rows) {
  cell = target_tag_size / len(rows);
  for (row = [0:len(rows) - 1]) for (column = [0:len(rows) - 1]) if (rows[row][column] == "1")
    translate([column * cell - target_tag_size / 2, row * cell - target_tag_size / 2, -0.06]) cube([cell, cell, 0.1]);
}

module mirror_glass() {
  if (len(mirror_plane) > 0) {
    c = mirror_centre[0];
    color("#b0d8f0") translate(c) rotate([0, -45, 0])
      box([-mirror_half[0][0], -mirror_half[0][1], 0], [mirror_half[0][0], mirror_half[0][1], mirror_thickness]);
  }
}

module nano() {
  board = nano_board();
  translate([0, 0, z_bottom + board[2]]) {
    color("#00707a") box([-9, board[0], 0], [9, board[1], 1.6]);
    color("#c8c8c8") box([-4, board[1] - 7, 1.6], [4, board[1] + 1, 5.4]);
  }
}

/// Helices glued into their sockets; their upper ends follow the displacement.
module coils(d = [0, 0, 0, 0, 0, 0]) {
  low = z_cover_top - springs_socket;
  high = z_plate_bottom + springs_socket;
  coils = 9;
  per = 14;
  radius = (springs_outer_diameter - springs_wire) / 2;
  color("#383838") for (at = springs) {
    shift = [d[0], d[1], d[2]];
    points = [for (i = [0:coils * per])
      let (u = i / (coils * per), a = 360 * i / per)
      [at[0], at[1], low] + u * [0, 0, high - low] + u * u * (3 - 2 * u) * shift + radius * [cos(a), sin(a), 0]];
    tube(points, springs_wire / 2);
  }
}

/// The hull of each spring, at rest or with its upper end displaced.
module spring_bodies(d = [0, 0, 0, 0, 0, 0]) {
  for (at = springs) hull() {
    translate([at[0], at[1], z_cover_top]) cylinder(d = springs_outer_diameter, h = eps);
    displaced(d) translate([at[0], at[1], z_plate_bottom - eps]) cylinder(d = springs_outer_diameter, h = eps);
  }
}

module tube(points, r, sides = 6) {
  rings = len(points);
  ring = [for (i = [0:rings - 1]) let (
            along = points[min(i + 1, rings - 1)] - points[max(i - 1, 0)],
            t = along / norm(along),
            across = cross(t, [0, 0, 1]) / norm(cross(t, [0, 0, 1])),
            up = cross(across, t))
          for (k = [0:sides - 1]) points[i] + r * (cos(360 * k / sides) * across + sin(360 * k / sides) * up)];
  faces = [for (i = [0:rings - 2]) for (k = [0:sides - 1])
    [i * sides + k, i * sides + (k + 1) % sides, (i + 1) * sides + (k + 1) % sides, (i + 1) * sides + k]];
  first = [for (k = [sides - 1:-1:0]) k];
  last = [for (k = [0:sides - 1]) (rings - 1) * sides + k];
  polyhedron(ring, concat(faces, [first], [last]), convexity = 10);
}
