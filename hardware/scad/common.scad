// What all parts share. Lengths in mm; frame: the camera's axes, x along the board's long side, z up, origin under
// the lens on the lower face of the mounting plate. Numbers come from parameters.scad, which
// `tagwrench design --hardware FILE --export DIR` writes: OPENSCADPATH=DIR openscad hardware/scad/sensor.scad
include <parameters.scad>

$fn = 40;
eps = 0.01;
paper_thickness = 0.1;
paper_half = target_tag_size / 2 + target_border;
travel_x = stops[0][0];
travel_y = stops[0][1];
travel_z = stops[0][2];
cover_from = cover_x[0][0];
cover_to = cover_x[0][1];
inner_from = inner_x[0][0];
inner_to = inner_x[0][1];
four_walls = top_walls == 4;
roof_edge = 0.4;      // of the tags' roof beyond the papers
engraving = 0.4;      // two layers
m2_head = 4.0;        // countersunk, ISO 7046
m3_head = 5.6;        // pan head, ISO 7045
m3_head_room = 6.5;
mirror_thickness = 1;  // of a piece of first-surface mirror
/// On the cover's top, beside the lens and the LED.
holder_screws = [for (y = [-7.6, 7.6]) [bore_radius + 4.4, y]];
tie = [1.7, 3.2];     // slot for a cable tie of 2.5 mm
/// Narrower than the printed faces by which it is put on; wider where it holds a board.
foot_x = [min(-camera_width / 2, cover_from), max(camera_width / 2, cover_to)];
foot_y = max(camera_depth / 2, cover_y_half);

module box(from, to) {
  translate(from) cube(to - from);
}

module plate2d(x, y, r = 1.5) {
  translate([x[0] + r, y[0] + r]) offset(r = r) square([x[1] - x[0] - 2 * r, y[1] - y[0] - 2 * r]);
}

module slab(x, y, z, r = 1.5) {
  translate([0, 0, z[0]]) linear_extrude(z[1] - z[0], convexity = 8) plate2d(x, y, r);
}

module hole(at, d, z) {
  translate([at[0], at[1], z[0]]) cylinder(d = d, h = z[1] - z[0]);
}

/// Room for a countersunk head that ends flush with z; up: the head is above the thread.
module countersink(at, hole, head, z, up) {
  depth = (head - hole) / 2;
  translate([at[0], at[1], z]) mirror([0, 0, up ? 1 : 0])
    translate([0, 0, -eps]) cylinder(d1 = head + 2 * eps, d2 = hole, h = depth + eps);
}

/// Cut into a face that lies on the printer's bed: a triangle towards +x, and the variant's name behind it. To be
/// read from above (up) or from below. The name takes no more than `space`.
module first_layer_mark(at, z, up, size = 4, words = "", space = 100) {
  if (!$bare) {
    translate([at[0], at[1], z]) mirror([0, up ? 0 : 1, 0]) translate([0, 0, up ? -engraving : -eps])
      linear_extrude(engraving + eps, convexity = 8) {
        polygon([[-size / 2, -size / 2], [size / 2, 0], [-size / 2, size / 2]]);
        if (len(words) > 0)
          translate([-size, 0]) text(words, size = fitting(words, size, space), halign = "right", valign = "center", $fn = 8);
      }
  }
}

/// Of letters that are 0.85 of their size wide.
function fitting(words, size, space) = min(size, space / (0.85 * max(1, len(words))));

/// A point of the platform's frame, at rest.
module on_platform() {
  translate([0, 0, z_platform]) children();
}

/// In the frame of the tag: x right, y down on the paper, z into it.
module at_tag(tag) {
  on_platform() translate([tag[0], tag[1], tag[2]]) turned([tag[3], tag[4], tag[5]]) children();
}

module turned(r) {
  if (norm(r) > 0) rotate(a = norm(r), v = r) children();
  else children();
}

/// The platform displaced by [x, y, z, rx, ry, rz]: mm, rotation vector in degrees.
module displaced(d) {
  translate([d[0], d[1], d[2]]) on_platform() turned([d[3], d[4], d[5]]) translate([0, 0, -z_platform]) children();
}

/// For the screws from which a weight hangs: M2 cuts its thread.
module load_holes() {
  for (at = load_points)
    on_platform() translate(at) rotate([0, 0, atan2(at[1], at[0])]) rotate([0, -90, 0])
      translate([0, 0, -0.5]) cylinder(d = top_thread_hole, h = 6);
}

/// A stop screw's own frame: z along the screw into the cover, from the cover's face.
module at_stop_screw(s) {
  sign = s[s[3]] < 0 ? -1 : 1;
  translate([s[0], s[1], s[2]])
    if (s[3] == 0) rotate([0, -90 * sign, 0]) children();
    else rotate([90 * sign, 0, 0]) children();
}
