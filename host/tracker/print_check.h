// Is what is printed where a pose puts a tag that tag, or another one of its family? Most bits of
// two tags may agree: then their pictures look alike, and alignment with the wrong one passes for a
// tag that is dirty here and there.
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "host/core/types.h"
#include "host/tracker/camera_model.h"
#include "host/tracker/edges.h"
#include "host/tracker/target.h"

namespace tagwrench {

/// What the cells of a tag say of it.
struct PrintReading {
  enum class Verdict : std::uint8_t {
    unclear,  ///< too little of it is clearly black or white
    agrees,
    other,  ///< clearly another tag
  };
  Verdict verdict = Verdict::unclear;
  int other_id = 0;  ///< of the family; which one is seen, where it is another
};

/// Reads cells where a pose has them and compares them with the family's bits. A tag is called
/// another one only when its black border and its white margin are there to see, at least two cells
/// contradict its own bits, and no cell that is clearly black or white contradicts the other's: a
/// cover comes in over the margin, and dirt does not print tags.
class PrintCheck {
 public:
  /// Knows all bits of the family. Allocates; read() does not.
  PrintCheck(const CameraModel& camera, TagFamily family, std::vector<TagPattern> patterns);

  /// `tag`: its place in the target. The image is as delivered, mirrored or not; only `readable` of
  /// it is looked at. Some 20 us, 40 us for 100 cells.
  PrintReading read(const ImageView& image, const Region& readable, std::size_t tag,
                    const Eigen::Isometry3d& camera_T_tag) const noexcept;
  PrintReading read(const PixelView<float>& image, std::size_t tag,
                    const Eigen::Isometry3d& camera_T_tag) const noexcept;

 private:
  /// The cells within the black border, row by row from the top left, a bit each.
  using Bits = std::array<std::uint64_t, 2>;
  struct Known {
    int id = 0;
    Bits white{};
  };

  template <class Pixel>
  PrintReading look(const PixelView<Pixel>& image, const Region& readable, std::size_t tag,
                    const Eigen::Isometry3d& camera_T_tag) const noexcept;
  PrintReading compare(std::size_t tag, const Bits& white, const Bits& clear) const noexcept;

  CameraModel camera_;  ///< of the image as delivered
  std::vector<TagPattern> patterns_;
  std::vector<Known> known_;  ///< every id, turned four ways
};

/// Another tag is where one of the target's should be.
struct OtherPrint {
  std::size_t tag = 0;  ///< place in the target
  int seen_id = 0;
};

/// Looks at the tags of a target that is held: at all of them when it was found anew and while one
/// is another, otherwise at one every few frames. No heap.
class PrintWatch {
 public:
  PrintWatch(const CameraModel& camera, TagFamily family, std::vector<TagPattern> patterns)
      : tags_(patterns.size()), check_(camera, family, std::move(patterns)) {}

  /// False from the first look at which a tag is another, until it is seen to be itself.
  bool agrees(const Frame& frame, const Eigen::Isometry3d& camera_T_platform,
              const std::vector<Eigen::Isometry3d>& platform_T_tag, bool anew) noexcept;

  const std::optional<OtherPrint>& other() const noexcept { return other_; }

 private:
  std::size_t tags_;
  PrintCheck check_;
  std::optional<OtherPrint> other_;
  unsigned frames_ = 0;
};

}  // namespace tagwrench
