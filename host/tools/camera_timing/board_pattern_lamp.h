// A board's LED as the lamp of a measurement.
#pragma once

#include <functional>

#include "host/board/board_session.h"
#include "host/tools/camera_timing/pattern_lamp.h"

namespace tagwrench {

class BoardPatternLamp final : public PatternLamp {
 public:
  /// `session`, borrowed, is ready and its clock known. `pump` carries bytes between it and the
  /// board whenever it is called; `poll_fd` is readable when that is worth it.
  BoardPatternLamp(link::BoardSession& session, std::function<void()> pump, int poll_fd);

  void off() override;
  void steady(int level_permille) override;
  void pattern(Duration bit, std::uint16_t seed) override;
  std::optional<PatternTiming> timing() const override;
  int poll_fd() const noexcept override { return poll_fd_; }
  void service() noexcept override;
  std::string trouble() const override { return trouble_; }
  Duration shortest_bit() const noexcept override;

 private:
  void order(const link::Led& led);

  link::BoardSession& session_;
  std::function<void()> pump_;
  int poll_fd_;
  std::uint32_t restarts_;
  link::Led led_{};
  std::string trouble_;
};

}  // namespace tagwrench
