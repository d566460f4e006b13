// Holds the mirror, glued on, above the lens; screwed onto the cover between the springs. Printed as it stands: the
// mirror's back is a slope of 45 degrees.
include <common.scad>

back = 1.2;   // behind the glass
cheek = 1.5;  // beside it
foot = 2;     // height on the cover
gap = 0.2;    // for the glass, at each side

module mirror_holder() {
  if (len(mirror_plane) > 0) difference() {
    union() {
      cheeks();
      at_mirror() box([-mirror_half[0][0], -inner_half() - eps, mirror_thickness],
                      [mirror_half[0][0], inner_half() + eps, mirror_thickness + back]);
      feet();
    }
    for (at = holder_screws) hole(at, 2.3, [z_cover_top - 1, z_cover_top + foot + 1]);
    first_layer_mark([bore_radius + 2, 0], z_cover_top, false, 2);
  }
}

/// In the mirror's frame: x up the slope, z into its back.
module at_mirror() {
  translate(mirror_centre[0]) rotate([0, -45, 0]) children();
}

function inner_half() = mirror_half[0][1] + gap;

module cheeks() {
  c = mirror_centre[0];
  low = bore_radius - 0.6;
  half = mirror_half[0][0] / sqrt(2);
  thick = (mirror_thickness + back) / sqrt(2);
  for (y = [-inner_half() - cheek, inner_half()])
    translate([0, y + cheek, 0]) rotate([90, 0, 0]) linear_extrude(cheek)
      polygon([[low, z_cover_top], [low + 4, z_cover_top],
               [c[0] + half + 0.8, c[2] + half - 0.8], [c[0] + half - thick, c[2] + half + thick],
               [c[0] - half - thick, c[2] - half + thick], [c[0] - half, c[2] - half]]);
}

module feet() {
  translate([0, 0, z_cover_top]) linear_extrude(foot) difference() {
    union() {
      translate([bore_radius + 0.4, -inner_half() - cheek]) square([2.6, 2 * (inner_half() + cheek)]);
      for (at = holder_screws) hull() {
        translate(at) circle(r = 2.4);
        translate([bore_radius + 1.7, (at[1] > 0 ? 1 : -1) * (inner_half() + cheek / 2)]) circle(r = 0.9);
      }
    }
    circle(r = bore_radius);
  }
}

module holder_on_bed() {
  translate([0, 0, -z_cover_top]) children();
}
