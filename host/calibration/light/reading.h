// How bright the tags are in a picture.
#pragma once

#include <vector>

#include "host/calibration/light/control.h"
#include "host/core/types.h"
#include "host/tracker/acquire.h"

namespace tagwrench {

/// White is what one pixel in twenty of a tag exceeds, of the brightest tag; pixels count that lie
/// within a tag's corners. Where no tag was found, it is what one pixel in a hundred of the whole
/// picture exceeds, and nothing counts as clipped that is darker. `mirrored`: corners are of the
/// picture flipped left to right, as Acquirer::find() gives them for such a camera.
LightReading read_light(const ImageView& image, bool mirrored, const std::vector<FoundTag>& tags);

}  // namespace tagwrench
