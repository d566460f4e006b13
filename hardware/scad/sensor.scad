// The sensor. Choose what to see with `part`:
//   mounting_plate camera_cover top_plate light_shield knob puck_base mirror_holder   in place; print = true: on the bed
//   assembly exploded section step_1 ... step_8                                      for people; step_8: a puck's base
//   fixed moving springs                                                              groups; moving: by `displacement`
//   collision                     what fixed and moving parts share over the whole travel, scaled by `share`: nothing
//   contact                       what they share at `displacement`
// `row` >= 0 takes one row of the travel only. Each variant's own parts: `parts` in parameters.scad.
include <common.scad>
use <camera_cover.scad>
use <dummies.scad>
use <knob.scad>
use <light_shield.scad>
use <mirror_holder.scad>
use <mounting_plate.scad>
use <puck_base.scad>
use <top_plate.scad>

part = "assembly";
print = false;
displacement = [0, 0, 0, 0, 0, 0];
share = 0.95;
row = -1;
$bare = part == "collision" || part == "contact" || part == "fixed" || part == "moving";

grey = "#6f6f74";
white = "#f4f1e6";
blue = "#2f8fc4";
brown = "#5b4648";
light = "#c9c9cc";

if (print) on_bed(part) printed(part);
else if (part == "assembly") assembly();
else if (part == "exploded") exploded();
else if (part == "section") section();
else if (part == "fixed") fixed();
else if (part == "moving") displaced(displacement) moving();
else if (part == "springs") spring_bodies(displacement);
else if (part == "contact") shared(displacement);
else if (part == "collision") {
  rows = row < 0 ? travel : [travel[row]];
  for (d = rows) shared(share * d);
}
else if (len(search("step_", part)) == 5 && len(part) == 6) step(part[5]);
else printed(part);

module printed(part) {
  if (part == "mounting_plate") mounting_plate();
  else if (part == "camera_cover") camera_cover();
  else if (part == "top_plate") top_plate();
  else if (part == "light_shield") light_shield();
  else if (part == "knob") knob();
  else if (part == "puck_base") puck_base();
  else if (part == "mirror_holder") mirror_holder();
  else assert(false, str("there is no part ", part));
}

/// As it is printed.
module on_bed(part) {
  if (part == "mounting_plate") children();
  else if (part == "puck_base") translate([0, 0, -z_bottom]) children();
  else if (part == "camera_cover") upside_down(z_cover_top) children();
  else if (part == "top_plate") upside_down(z_plate_top) children();
  else if (part == "mirror_holder") holder_on_bed() children();
  else upside_down(z_top) children();
}

module upside_down(z) {
  rotate([180, 0, 0]) translate([0, 0, -z]) children();
}

module hood() {
  if (top_knob) knob();
  else light_shield();
}

module fixed() {
  mounting_plate();
  camera_cover();
  camera();
  if (mount_puck) puck_base();
  if (target_layout == "mirror") {
    mirror_holder();
    mirror_glass();
  }
}

module moving() {
  top_plate();
  hood();
  stop_screws_in();
}

module shared(d) {
  intersection() {
    fixed();
    displaced(d) moving();
  }
}

/// Everything in colour, raised by the heights in `up`.
module parts_apart(up) {
  if (mount_puck) color(grey) translate([0, 0, up[0]]) puck_base();
  translate([0, 0, up[1]]) color(grey) mounting_plate();
  translate([0, 0, up[1]]) bolts_below();
  translate([0, 0, up[2]]) camera();
  translate([0, 0, up[3]]) color(white) camera_cover();
  translate([0, 0, up[3] - up[8]]) led();
  translate([0, 0, up[4]]) coils();
  if (target_layout == "mirror") translate([0, 0, up[4]]) {
    color(grey) mirror_holder();
    mirror_glass();
  }
  translate([0, 0, up[5]]) color(blue) top_plate();
  translate([0, 0, up[6] - up[9]]) tag_papers();
  translate([0, 0, up[6]]) {
    color(brown) hood();
    translate([0, 0, up[7]]) roof_screws();
  }
  for (s = stop_screws) translate([0, 0, up[6]]) at_stop_screw(s) translate([0, 0, -up[7]]) one_stop_screw(s);
}

module one_stop_screw(s) {
  color("#c8c8c8") {
    translate([0, 0, -s[6]]) cylinder(d = stops_screw, h = s[5]);
    translate([0, 0, -s[6] - 2]) cylinder(d = m3_head, h = 2);
  }
}

module assembly() {
  parts_apart([0, 0, 0, 0, 0, 0, 0, 0, 0, 0]);
}

module exploded() {
  rise = 14;
  // So far that the hood clears what it covers.
  covered = z_plate_top - min(z_shield_bottom_x, z_shield_bottom_y);
  parts_apart([-2 * rise, 0, rise, 2.4 * rise, 3.4 * rise, 4.2 * rise, 4.6 * rise + covered, 8, 12, 6]);
}

/// Without what is towards -y.
module section() {
  if (mount_puck) {
    half(grey) puck_base();
    half("#00707a") nano();
  }
  half(grey) mounting_plate();
  half("#1c2a1c") camera();
  half(white) camera_cover();
  half("#ffd54a") led();
  half("#383838") coils();
  if (target_layout == "mirror") {
    half(grey) mirror_holder();
    half("#b0d8f0") mirror_glass();
  }
  half(blue) top_plate();
  half(brown) hood();
  half("white") tag_papers();
  half("#c8c8c8") {
    stop_screws_in();
    roof_screws();
  }
}

/// Rendered, so that what is cut keeps its colour.
module half(colour) {
  color(colour) render(convexity = 8) difference() {
    children();
    translate([-100, -200, -100]) cube(200);
  }
}

/// What the builder has in hand; the new piece a little apart.
module step(number) {
  if (number == "1") {
    color(grey) mounting_plate();
    translate([0, 0, 12]) camera();
  }
  else if (number == "2") upside_down(z_cover_top) {
    color(white) camera_cover();
    translate([0, 0, -20]) led();
  }
  else if (number == "3") {
    color(grey) mounting_plate();
    camera();
    translate([0, 0, 14]) {
      color(white) camera_cover();
      led();
    }
    translate([0, 0, -14]) bolts_below();
  }
  else if (number == "4") {
    base();
    translate([0, 0, 8]) coils();
    if (target_layout == "mirror") {
      color(grey) mirror_holder();
      mirror_glass();
    }
  }
  else if (number == "5") {
    base();
    with_springs();
    translate([0, 0, 8]) color(blue) top_plate();
  }
  else if (number == "6") upside_down(z_top) {
    color(light) hood();  // so that papers and ids stand out
    translate([0, 0, -5]) tag_papers();
    translate([inner_to + 18, 0, z_plate_top]) tags_enlarged(4);
  }
  else if (number == "7") {
    base();
    with_springs();
    color(blue) top_plate();
    translate([0, 0, 10]) {
      tag_papers();
      color(brown) hood();
      translate([0, 0, 8]) roof_screws();
      for (s = stop_screws) at_stop_screw(s) translate([0, 0, -9]) one_stop_screw(s);
    }
  }
  else if (number == "8" && mount_puck) {
    color(grey) puck_base();
    nano();
    translate([0, 0, 45]) assembly_above();
  }
  else assert(false, str("there is no step ", number));
}

module base() {
  color(grey) mounting_plate();
  camera();
  color(white) camera_cover();
}

module with_springs() {
  coils();
  if (target_layout == "mirror") {
    color(grey) mirror_holder();
    mirror_glass();
  }
}

module assembly_above() {
  base();
  with_springs();
  color(blue) top_plate();
  tag_papers();
  color(brown) hood();
}
