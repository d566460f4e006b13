// The light of an LED outside of the simulation: of a board, real, emulated or played.
#pragma once

namespace tagwrench::sim {

class LedLight {
 public:
  LedLight() = default;
  LedLight(const LedLight&) = delete;
  LedLight& operator=(const LedLight&) = delete;
  virtual ~LedLight() = default;

  /// Mean brightness, 0 (off) to 1 (on all the time), from `from` to `to` seconds of the source's
  /// simulation time; at an instant if they are equal. Asked row by row, in the order of time but
  /// for the overlap of the rows' exposures: an emulated board may be run up to `to` on the spot.
  virtual double mean(double from, double to) noexcept = 0;
};

}  // namespace tagwrench::sim
