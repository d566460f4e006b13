// How long and with what gain a camera exposes, where that can be set while it streams.
#pragma once

namespace tagwrench {

class CameraLight {
 public:
  /// Equal ends where it cannot be set.
  struct Range {
    double least = 0;
    double most = 0;
  };

  CameraLight() = default;
  CameraLight(const CameraLight&) = delete;
  CameraLight& operator=(const CameraLight&) = delete;
  virtual ~CameraLight() = default;

  /// What the camera exposes with at least and at most without lowering its frame rate, us.
  virtual Range exposure_range_us() const noexcept = 0;
  virtual double exposure_us() const noexcept = 0;
  /// Sets the nearest exposure that the camera has; of one of the next pictures on. False: refused.
  virtual bool set_exposure_us(double exposure_us) noexcept = 0;

  /// In the camera's own units: more is brighter, not always in proportion.
  virtual Range gain_range() const noexcept = 0;
  virtual double gain() const noexcept = 0;
  virtual bool set_gain(double gain) noexcept = 0;
};

}  // namespace tagwrench
