// A camera that adjusts itself moves the picture under the tracker: everything automatic is
// stopped, and put back at the end. The camera's controls are behind a small interface so that the
// order of doing can be tested without one.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace tagwrench {

struct ControlRange {
  std::int32_t minimum = 0;
  std::int32_t maximum = 0;
  std::int32_t step = 1;
  bool writable = true;
};

class ControlPort {
 public:
  ControlPort() = default;
  ControlPort(const ControlPort&) = delete;
  ControlPort& operator=(const ControlPort&) = delete;
  virtual ~ControlPort() = default;
  /// Nothing where the camera does not have control `id` (a V4L2_CID_ number).
  virtual std::optional<ControlRange> range(std::uint32_t id) = 0;
  virtual std::optional<std::int32_t> get(std::uint32_t id) = 0;
  virtual bool set(std::uint32_t id, std::int32_t value) = 0;
};

/// The controls of an open V4L2 device; does not own the descriptor.
class V4l2ControlPort final : public ControlPort {
 public:
  explicit V4l2ControlPort(int fd) : fd_(fd) {}
  std::optional<ControlRange> range(std::uint32_t id) override;
  std::optional<std::int32_t> get(std::uint32_t id) override;
  bool set(std::uint32_t id, std::int32_t value) override;

 private:
  int fd_;
};

/// Remembers, locks, restores. Never throws on what a camera refuses: it is listed instead.
class ControlLock {
 public:
  /// Remembers what every control is now, then stops the camera from trading frame rate for light,
  /// which would spoil what automatic exposure settles on next.
  void remember(ControlPort& port);
  /// Whether anything is automatic, so that waiting for it to settle is worth it.
  bool needs_settling() const noexcept { return needs_settling_; }
  /// Stops every automatism and fixes its value where it stands, or the exposure at `exposure_us`
  /// if that is not 0.
  void lock(ControlPort& port, int exposure_us);
  /// Another value for a control that lock() fixed, the nearest that the camera has. False: it
  /// was not fixed, or the camera refuses.
  bool change(ControlPort& port, std::uint32_t id, std::int64_t value);
  /// What a control was fixed at; nothing if it was not.
  std::optional<std::int32_t> locked(std::uint32_t id) const noexcept;
  /// Writes the locked values again, into a camera that was away.
  void relock(ControlPort& port);
  /// Puts everything back as remembered: values first, then the automatisms.
  void restore(ControlPort& port);

  /// Names of the controls that lock() would take, for people.
  static std::string available(ControlPort& port);
  /// "locked exposure, gain; refused sharpness; without focus".
  std::string description() const;

 private:
  void apply(ControlPort& port, std::size_t index, std::int32_t value);

  struct Setting {
    std::size_t index = 0;  ///< in the table of controls
    std::int32_t value = 0;
  };
  std::vector<Setting> original_;
  std::vector<Setting> locked_;
  std::vector<std::size_t> absent_;
  std::vector<std::size_t> refused_;
  bool needs_settling_ = false;
};

}  // namespace tagwrench
