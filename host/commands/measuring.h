// What verbs that measure share: the folder measured/, dates, an end before the result; and what
// they tell a program that started them: how far they are, as one JSON object a line. People are
// told the same in words, on standard error.
#pragma once

#include <array>
#include <chrono>
#include <filesystem>
#include <initializer_list>
#include <nlohmann/json_fwd.hpp>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "host/core/command_line/command_line.h"
#include "host/core/types.h"
#include "host/sensor/measured_files.h"

namespace tagwrench {

/// Exit status of a calibration that its user has stopped.
inline constexpr int kExitStopped = 1;
/// Says so, where nothing was written, and returns it.
int stopped_unwritten();

/// YYYY-MM-DD, here.
std::string today();

/// Today, by this program, for this sensor.yaml.
MeasuredStamp stamp_for(const std::filesystem::path& sensor);

/// A sensor.yaml and, where --out asks for it, the new one that results are measured for: the same
/// text in a folder of its own.
class MeasuredSensor {
 public:
  /// Throws ConfigError unless `files` of its measured/ can be written, or if --out names a
  /// sensor.yaml that is there already and says something else.
  MeasuredSensor(const std::string& sensor, const std::string& out,
                 const std::vector<const char*>& files);

  const std::filesystem::path& sensor() const { return to_; }
  std::filesystem::path folder() const { return measured_folder(to_); }
  /// Makes the new one, with those files of the old one's measured/ that `keeps` names. Before any
  /// result is written. Throws std::runtime_error.
  void make(const std::vector<const char*>& keeps) const;

 private:
  std::filesystem::path from_;
  std::filesystem::path to_;
};

/// A zero says nothing about another rest or another calibration: the one measured is set aside,
/// and one in sensor.yaml is overruled. Throws ConfigError or std::runtime_error.
void void_zero(const std::filesystem::path& sensor);

/// {"line":{"kind":"task|note|warning","text":".."}}, {"live":".."}, {"progress":0.4},
/// {"coverage":{..}}, {"picture":{"width":..,"height":..,"tags":[..],"jpeg":"base64"}}. Never
/// waits: what the reader has no room for is left out.
class Events {
 public:
  /// Borrows the descriptor; -1: nobody wants to know.
  explicit Events(int fd = -1) noexcept;
  Events(const Events&) = delete;
  Events& operator=(const Events&) = delete;

  bool on() const noexcept { return fd_ >= 0; }
  void line(std::string_view kind, const std::string& text) noexcept;
  /// Of this moment; ten a second are told.
  void live(const std::string& text) noexcept;
  /// 0..1
  void progress(double part) noexcept;
  /// What has been seen of what is wanted, by name.
  using Seen = std::variant<int, std::size_t, std::vector<int>, std::vector<double>,
                            std::vector<std::string>>;
  void coverage(std::initializer_list<std::pair<const char*, Seen>> seen) noexcept;
  /// Five a second are told; `tags` are outlines in the image.
  void picture(const ImageView& image, std::span<const TagCorners> tags) noexcept;

 private:
  bool due(TimePoint& last, Duration every) const noexcept;
  /// False: left out.
  bool send(const nlohmann::json& event);

  int fd_;
  std::string rest_;  ///< of an event that the pipe took a part of
  TimePoint live_{};
  TimePoint picture_{};
  int percent_ = -1;      ///< told last
  std::string coverage_;  ///< told last
};

/// The option by which a program that starts a verb asks for its events; no help mentions it.
inline void add_events_option(command_line::Command verb, int& descriptor) {
  verb.add_option("--events", descriptor).hidden().check(command_line::range(3, 1023));
}

/// The outline of a board as a tag's, from where its corners are; nothing where there are none.
std::vector<TagCorners> outline_of(std::span<const std::array<double, 2>> corners_px);

}  // namespace tagwrench
