// What a verb tells a program that started it: how far it is, as one JSON object a line. People are
// told the same in words, on standard error.
#pragma once

#include <array>
#include <chrono>
#include <cstdint>
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

namespace tagwrench {

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
