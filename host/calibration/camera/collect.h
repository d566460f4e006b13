// Takes views of the board by itself: when it is held still, sharp, and differs from those before.
#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "host/calibration/camera/board.h"
#include "host/calibration/camera/fit.h"
#include "host/calibration/camera/pictures.h"

namespace tagwrench {

enum class ViewResult : std::uint8_t {
  yes,
  moving,  ///< live only
  alike,   ///< as an earlier view
  no,      ///< see the look
};

class ViewCollector {
 public:
  /// `camera`: as sensor.yaml knows it so far. `live`: the frames are moments of one movement, and
  /// the board must rest for a view; else each image stands for itself.
  ViewCollector(const BoardSpec& board, const CameraModel& camera, bool live);

  /// `name` of the image, for people.
  ViewResult look(const ImageView& image, const std::string& name);

  /// What could not be looked at.
  void set_aside(Picture picture) { pictures_.add(std::move(picture)); }

  const std::vector<CameraView>& views() const { return views_; }
  /// All that was looked at or set aside; frames of a camera are counted, views of it named.
  const Pictures& pictures() const { return pictures_; }
  /// Of the image shown last.
  BoardView last_look() const { return last_look_; }
  bool mirrored() const { return finder_.mirrored(); }
  /// Of the last live image in which the board was found, flipped back if mirrored.
  const std::vector<BoardCorner>& last_corners() const { return previous_; }
  /// As given.
  const CameraModel& camera() const { return camera_; }
  /// Poses through what is known of the lens by now.
  Coverage coverage() const;

  /// Leaves at most so many, those that differ most from each other.
  void thin_out(int most);

  /// Throws ConfigError with the reason where no view, another board, only one pose, or too few
  /// views were found.
  void check() const;

 private:
  void keep(const ImageView& image);

  BoardSpec board_;
  CameraModel camera_;
  bool live_;
  BoardFinder finder_;
  std::vector<CameraView> views_;
  std::vector<BoardCorner> previous_;
  int still_frames_ = 0;
  BoardView last_look_ = BoardView::no_board;
  Pictures pictures_;
  std::vector<std::vector<std::uint8_t>> undetected_;  ///< images in which the board was not found
};

/// Mean distance of the corners that both show (px); a large number if they share too few.
double difference_px(const std::vector<BoardCorner>& a, const std::vector<BoardCorner>& b);

}  // namespace tagwrench
