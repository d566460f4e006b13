// A board's LED as the lamp that settling the light asks for.
#pragma once

#include "host/light_settle.h"
#include "host/link/board_link.h"

namespace tagwrench {

class BoardLamp final : public Lamp {
 public:
  /// Borrows the link, whose board has told its capabilities.
  explicit BoardLamp(link::BoardLink& link) : link_(link) {}

  void set_level(double permille) noexcept override;
  LightRange range_permille() const noexcept override;
  int poll_fd() const noexcept override { return link_.poll_fd(); }
  void service() noexcept override { link_.service(); }

 private:
  link::BoardLink& link_;
};

}  // namespace tagwrench
