// Under the puck: a bay for an Arduino Nano whose plug points to the back (+y, towards the screen), room for weights
// on both sides of it, the way out for both cables. Printed as it stands.
include <common.scad>

floor_thickness = 2.4;
side = 2.4;
board = [18, 45];      // of an Arduino Nano
board_play = 0.3;
rib = [1.6, 5];        // around the board: thickness, height
under = 2.5;           // the board stands on: solder and wires below
plug_room = 26;
screw_post = 8;
screw_hole = 2.6;      // M3 cuts its thread
screw_radius = mount_width / 2 - 5;
outlet = [13, 8];      // for two cables, side by side
foot = [8.4, 1];       // rubber feet of 8 mm
inner_radius = mount_width / 2 - side;
board_to = min(inner_radius - plug_room, board[1] / 2);
board_from = board_to - board[1];

/// Where the board lies: from y, to y, its lower face above z_bottom.
function nano_board() = [board_from, board_to, floor_thickness + under];

module puck_base() {
  difference() {
    union() {
      difference() {
        translate([0, 0, z_bottom]) cylinder(d = mount_width, h = mount_bay_height, $fn = 90);
        translate([0, 0, z_bottom + floor_thickness]) cylinder(r = inner_radius, h = mount_bay_height, $fn = 90);
      }
      for (a = [45:90:315]) hole(screw_radius * [cos(a), sin(a)], screw_post, [z_bottom, 0]);
      board_bay();
      bridge();
    }
    for (a = [45:90:315]) {
      at = screw_radius * [cos(a), sin(a)];
      hole(at, screw_hole, [max(z_bottom + floor_thickness, -12), 1]);
      hole((screw_radius - 6) * [cos(a), sin(a)], foot[0], [z_bottom - 1, z_bottom + foot[1]]);
    }
    box([-outlet[0] / 2, inner_radius - 4, -outlet[1]], [outlet[0] / 2, mount_width / 2 + 1, 1]);
    first_layer_mark([4, -inner_radius / 2 - 4], z_bottom, false, 5, name);
  }
}

module board_bay() {
  half = board[0] / 2 + board_play;
  from = board_from - board_play;
  to = board_to + board_play;
  z = z_bottom + floor_thickness - eps;
  for (x = [-1, 1]) {
    box([x > 0 ? half : -half - rib[0], from, z], [x > 0 ? half + rib[0] : -half, to, z + rib[1]]);
    box([x > 0 ? half - 1.2 : -half, from, z], [x > 0 ? half : -half + 1.2, to, z + under]);
  }
  box([-half - rib[0], from - rib[0], z], [half + rib[0], from + eps, z + rib[1]]);
  // Open for the plug.
  for (x = [-1, 1]) box([x > 0 ? 6 : -half - rib[0], to - eps, z], [x > 0 ? half + rib[0] : -6, to + rib[0], z + rib[1]]);
}

/// Two posts beside the outlet: a cable tie around both cables, behind the posts, takes the pull.
module bridge() {
  y = inner_radius - 6;
  for (x = [-1, 1])
    translate([x * (outlet[0] / 2 + 2), y, z_bottom]) cylinder(d = 4, h = mount_bay_height - 1);
}
