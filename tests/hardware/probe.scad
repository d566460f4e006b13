// What the tests ask the drawing beside its parts: where `part` lies on the bed, shown by a corner of three unequal arms;
// what is bought and stands still, and what is bought and moves with the platform.
include <common.scad>
use <dummies.scad>
use <sensor.scad>

part = "";
group = "bed";

if (group == "bed") on_bed(part) polyhedron([[0, 0, 0], [1, 0, 0], [0, 2, 0], [0, 0, 3]],
                                            [[0, 1, 2], [0, 3, 1], [0, 2, 3], [1, 3, 2]]);
if (group == "fixed") {
  camera();
  bolts_below();
  led();
  if (target_layout == "mirror") mirror_glass();
}
if (group == "moving") {
  stop_screws_in();
  roof_screws();
  tag_papers();
}
