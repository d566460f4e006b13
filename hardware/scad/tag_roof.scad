// What the tags are glued on, hanging from the shield's roof through the opening of the top plate.
include <common.scad>

leg = 1.2;  // thickness behind a sideways tag

module tag_roof() {
  if (target_layout == "roof") hull() {
    for (tag = tags) at_tag(tag) {
      ridge = tag[3] > 0 ? -1 : 1;  // where on the paper's y axis the other tag is
      // Nearer to the ridge than the paper by as much as both faces come together behind it.
      inner = ridge * (paper_half + target_ridge_gap - (paper_thickness + eps) * tan(target_angle));
      outer = -ridge * (paper_half + roof_edge);
      box([-paper_half - roof_edge, min(inner, outer), paper_thickness],
          [paper_half + roof_edge, max(inner, outer), paper_thickness + eps]);
    }
    onto_roof(tags);
  }
  else for (tag = tags) {
    if (tag[4] == 0) hull() {
      at_tag(tag) patch(eps);
      onto_roof([tag]);
    }
    else hull() {
      at_tag(tag) patch(leg);
      x = tag[0] + paper_thickness;
      box([x, -paper_half - roof_edge, z_plate_top - eps], [x + leg, paper_half + roof_edge, z_plate_top]);
    }
  }
}

module patch(thickness) {
  half = paper_half + roof_edge;
  box([-half, -half, paper_thickness], [half, half, paper_thickness + thickness]);
}

/// The outline of these tags, seen from above, where it meets the shield.
module onto_roof(of) {
  translate([0, 0, z_plate_top - eps]) linear_extrude(eps) hull() projection() for (tag = of) at_tag(tag) patch(eps);
}
