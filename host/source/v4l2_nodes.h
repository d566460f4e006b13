// Which camera nodes there are, what they are called and who holds them. For messages and the
// doctor.
#pragma once

#include <string>
#include <vector>

#include "host/source/v4l2_mode.h"

namespace tagwrench {

struct CameraNode {
  std::string path;  ///< /dev/videoN
  int error = 0;     ///< errno of opening or asking it, 0 if it answered
  std::string card;  ///< the camera's name
  std::string driver;
  bool captures = false;
  std::vector<V4l2Mode> modes;  ///< understood ones; empty unless it captures
  std::string controls;         ///< those that a run would lock, for people
};

/// Every /dev/videoN in order of N.
std::vector<CameraNode> list_camera_nodes();

/// "/dev/video0 (HD Webcam), /dev/video2 (...)", or a sentence that there is none.
std::string capture_nodes_text();

/// The link in /dev/v4l/by-id, else by-path, that leads to this node; else the path itself.
std::string stable_path(const std::string& path);

/// "ffmpeg (pid 41), obs (pid 7)": other processes that have the node open, as far as /proc shows
/// them.
std::string holders_text(const std::string& path);

}  // namespace tagwrench
