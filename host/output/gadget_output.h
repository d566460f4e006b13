// A real USB device of another computer, through a gadget that `tagwrench gadget up` has made.
#pragma once

#include <sys/types.h>

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "host/output/gadget_daemon.h"
#include "host/output/gadget_kernel.h"
#include "host/output/output.h"
#include "host/output/watchdog.h"

namespace tagwrench {

struct GadgetOptions {
  std::string name = "sensor";     ///< of the gadget, as `tagwrench gadget up --name` has it
  std::optional<GadgetFace> face;  ///< none: whichever is up
  KernelPlaces places;
};

/// A gadget that is up, and its node.
struct GadgetPort {
  GadgetFace face = GadgetFace::spacemouse;
  bool spnav_order = false;  ///< see SpacemouseOptions::vendor
  KernelPlaces places;
  std::string function;  ///< of the gadget, in configfs
  OpenedNode node;
  /// Program whose verb `gadget` has the daemon.
  std::string program = "/proc/self/exe";
};

/// Throws ConfigError: not up, another face, no permission, another bridge writes to it.
GadgetPort find_gadget(const GadgetOptions& options);

/// The life of the daemon that a GadgetOutput starts (`tagwrench gadget keep`), by what it was
/// given.
struct GadgetInheritance {
  GadgetFace face = GadgetFace::spacemouse;
  KernelPlaces places;
  std::string function;
  std::string node;  ///< path
};
void keep_gadget(const GadgetInheritance& given);

/// The SpaceMouse moves with every move() as SpacemouseOutput does; the wrench sensor has a report
/// for every send(). The other computer's going, sleeping and coming back are no failures: it gets
/// what is then.
class GadgetOutput : public Output {
 public:
  /// Throws ConfigError if a process for it cannot be had.
  explicit GadgetOutput(GadgetPort port);
  ~GadgetOutput() override;

  SendStatus send(const Sample& sample) noexcept override;
  SendStatus move(const Sample& sample) noexcept override;
  std::string failure() const override;
  int poll_fd() const noexcept override { return lost_ ? -1 : link_.get(); }
  std::string_view service() noexcept override;

  GadgetFace face() const noexcept { return face_; }
  void add_to(std::vector<WatchdogDevice>& devices) const;

 private:
  void start_daemon(const GadgetPort& port);
  void await_daemon();
  SendStatus put(std::span<const std::uint8_t> reports) noexcept;

  GadgetFace face_;
  bool spnav_order_;
  KernelPlaces places_;
  std::string function_;
  UniqueFd link_;
  pid_t daemon_ = 0;
  bool lost_ = false;  ///< the daemon
};

}  // namespace tagwrench
