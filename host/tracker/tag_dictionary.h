// A tag family as OpenCV's detector wants it. Uses OpenCV.
#pragma once

#include <opencv2/aruco/dictionary.hpp>

#include "host/tracker/target.h"

namespace tagwrench {

/// One of OpenCV's dictionaries, or one made of our own bits for grid_10x10.
cv::Ptr<cv::aruco::Dictionary> tag_dictionary(TagFamily family);

}  // namespace tagwrench
