// Light and sharpness of the pictures that a page shows. In the server's thread.
#pragma once

#include <nlohmann/json.hpp>
#include <span>

#include "host/core/types.h"
#include "host/tracker/acquire.h"
#include "host/tracker/target.h"

namespace tagwrench {

class PictureFigures {
 public:
  /// Throws ConfigError for a target that cannot be tracked.
  PictureFigures(const CameraModel& camera, const TargetDescription& target);

  /// Twice a second at most something is measured, and the width of one tag's edges each time.
  /// `corners`: where the tags were, about then.
  void look(const ImageView& picture, std::span<const TagCorners> corners);
  /// {"white","black","clipped_part","edges_px":[{"id","px"}]}; null before the first picture.
  const nlohmann::json& figures() const { return figures_; }

 private:
  struct Edges {
    int id = 0;
    double px = 0;  ///< 0: not known
  };
  void measure_edges(const ImageView& picture, std::span<const TagCorners> corners);

  Acquirer patterns_;
  bool mirrored_;
  std::vector<Edges> edges_;
  std::size_t next_ = 0;
  TimePoint last_{};
  nlohmann::json figures_ = nullptr;
};

}  // namespace tagwrench
