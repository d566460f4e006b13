// Corners of rendered boards beside where the renderer put them.
#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/calib3d.hpp>
#include <opencv2/core.hpp>

#include "host/calibration/camera/board.h"
#include "tests/unit/calibration/camera/camera_render.h"

namespace tagwrench::test {
namespace {

constexpr const char* kCharuco = "charuco:9x6:1.2mm:0.9mm:aruco_4x4_50";
constexpr const char* kCheckerboard = "checkerboard:9x6:1.2mm";
constexpr double kTilt = 0.5;  // rad

struct Seen {
  BoardSighting sighting;
  double rms_px = 0;
};

/// A tilted board, and how far its corners are found from where they are.
Seen seen(const std::string& board, const Conditions& conditions) {
  const Lens lens;
  const BoardRenderer renderer(parse_board(board), lens);
  const Placement p = good_placements(lens, 5, kTilt)[4];
  const cv::Mat image = renderer.render(p, 7, conditions);
  Seen out;
  out.sighting = BoardFinder(parse_board(board), false).find(view_of(image));
  cv::Matx33d r;
  cv::Rodrigues(p.rotation, r);
  double sum = 0, turned = 0;  // a checkerboard may be found from its other end
  for (const BoardCorner& corner : out.sighting.corners) {
    for (const double sign : {1.0, -1.0}) {
      const cv::Vec3d at =
          r * cv::Vec3d(sign * (corner.board.x() - 4.5), sign * (corner.board.y() - 3), 0) +
          p.middle;
      const cv::Point2d is = lens.project(at[0] / at[2], at[1] / at[2]);
      (sign > 0 ? sum : turned) +=
          std::pow(corner.pixel.x() - is.x, 2) + std::pow(corner.pixel.y() - is.y, 2);
    }
  }
  out.rms_px = std::sqrt(std::min(sum, turned) / static_cast<double>(out.sighting.corners.size()));
  return out;
}

TEST(BoardCorners, AreFoundToAFewHundredthsOfAPixel) {
  for (const double blur : {0.7, 1.4, 2.0}) {
    Conditions conditions;
    conditions.blur_px = blur;
    const Seen board = seen(kCharuco, conditions);
    ASSERT_EQ(board.sighting.look, BoardView::board);
    ASSERT_GE(board.sighting.corners.size(), 20u);
    EXPECT_LT(board.rms_px, 0.025 * std::max(1.0, blur));
    EXPECT_NEAR(board.sighting.corner_view.blur_px, std::hypot(blur, 0.3),
                0.15);  // px; a pixel adds 0.29
    EXPECT_NEAR(board.sighting.corner_view.contrast, conditions.white - conditions.black, 10);
    EXPECT_EQ(board.sighting.corner_view.clipped_fraction, 0);
  }
}

// Clipping takes away the white half of every edge, on both sides of a corner alike.
TEST(BoardCorners, StayWhereTheyAreWhereWhiteIsCutOff) {
  struct Light {
    double white;  // grey levels, cut off at 255
    double worst_px;
  };
  for (const char* board : {kCharuco, kCheckerboard}) {
    for (const double blur : {0.5, 0.7, 1.4}) {
      for (const Light& light : {Light{300, 0.025}, Light{400, 0.035}, Light{500, 0.05}}) {
        Conditions conditions;
        conditions.blur_px = blur;
        conditions.white = light.white;
        const Seen bright = seen(board, conditions);
        EXPECT_EQ(bright.sighting.look, BoardView::board) << words(bright.sighting.look);
        EXPECT_GT(bright.sighting.corner_view.clipped_fraction, 0.9);
        EXPECT_LT(bright.rms_px, light.worst_px)
            << board << ", blur " << blur << " px, white " << light.white;
        EXPECT_NEAR(bright.sighting.corner_view.blur_px, std::hypot(blur, 0.3), 0.15);
      }
    }
  }
}

}  // namespace
}  // namespace tagwrench::test
