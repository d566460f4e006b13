// In the place of the shield, for a hand. Printed upside down; hollow enough at 15 % infill.
include <common.scad>
use <light_shield.scad>

grooves = 16;
chamfer = 2.5;

module knob() {
  r = top_knob_diameter / 2;
  difference() {
    union() {
      difference() {
        union() {
          translate([0, 0, z_shield_bottom_x]) linear_extrude(z_top - chamfer - z_shield_bottom_x, convexity = 8) grip(r);
          // The chamfer takes the grip's outline, grooves and all, so that nothing hangs over as it is printed.
          translate([0, 0, z_top - chamfer - eps])
            linear_extrude(chamfer + eps, scale = (r - chamfer) / r, convexity = 8) grip(r);
        }
        box([inner_from, -inner_y, z_shield_bottom_x - 1], [inner_to, inner_y, z_plate_top]);
      }
      inside();
    }
    cuts();
  }
}

module grip(r) {
  difference() {
    circle(r = r, $fn = 64);
    if (!$bare) for (i = [0:grooves - 1]) rotate(360 * (i + 0.5) / grooves) translate([r + 1.5, 0]) circle(r = 2.5, $fn = 16);
  }
}
