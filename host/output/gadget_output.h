// A real USB device of another computer, through a gadget that `tagwrench gadget up` has made.
#pragma once

#include <sys/types.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "host/core/os/unique_fd.h"
#include "host/output/gadget_tree.h"
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

/// The life of the daemon of a GadgetOutput (`tagwrench gadget keep`), of what it is given.
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

  GadgetFace face() const noexcept { return port_.face; }
  void add_to(std::vector<WatchdogDevice>& devices) const;

 private:
  SendStatus put(std::span<const std::uint8_t> reports) noexcept;

  GadgetPort port_;  ///< whose node is the daemon's alone
  UniqueFd link_;
  pid_t daemon_ = 0;
  bool lost_ = false;  ///< the daemon
};

// What a gadget's other computer is still owed: the newest report of each kind, never one before.

class GadgetReports {
 public:
  static constexpr std::size_t kMax = 64;

  /// All at rest, nothing owed.
  explicit GadgetReports(GadgetFace face) noexcept;

  /// Reports one behind the other, report id first, each of its full length. Each replaces the one
  /// of its kind; buttons as they were are not owed. What is no report of this face is dropped.
  void put(std::span<const std::uint8_t> reports) noexcept;

  /// All at rest, and owed.
  void rest() noexcept {
    *this = GadgetReports(face_);
    renew();
  }
  /// A computer that has seen nothing yet is owed all.
  void renew() noexcept {
    for (Kind& kind : kinds()) kind.owed = true;
  }

  bool owed() noexcept { return first_owed() != nullptr; }
  /// The one to write next: buttons before motion, which is owed nearly always. A motion that has
  /// been taken already is dithered (see dithered()). Valid until the next call.
  std::span<const std::uint8_t> next() noexcept;
  /// The last next() is written.
  void taken() noexcept;

 private:
  struct Kind {
    std::uint8_t id = 0;
    std::size_t size = 0;
    bool stream = false;  ///< motion and samples: every one counts, even if it repeats the last
    bool axes = false;
    bool owed = false;
    std::array<std::uint8_t, kMax> newest{};
    std::array<std::uint8_t, kMax> last{};  ///< taken

    std::span<const std::uint8_t> bytes() const { return {newest.data(), size}; }
  };
  std::span<Kind> kinds() noexcept { return {kinds_.data(), count_}; }
  Kind* first_owed() noexcept;

  GadgetFace face_;
  std::array<Kind, 2> kinds_;
  std::size_t count_ = 0;
  std::array<std::uint8_t, kMax> out_{};
};

// Who writes to a gadget's /dev/hidgN: a PROCESS between the bridge and the other computer.
//
// The kernel has room for one report. While the other computer does not take it (it asks every
// millisecond or every ten; asleep, it does not ask at all), the next write is refused, and a
// neutral report that is refused would leave the view turning. So somebody must stay until it is
// taken, whatever has become of the bridge: this process keeps the newest report of each kind, and
// when the bridge is gone it leaves only after rest has been taken or nobody is plugged in.
//
// It lets go of the node of a gadget that goes away. Kernels without two corrections of spring 2026
// ("f_hid: move list and spinlock inits from bind to alloc", "don't call cdev_init while cdev in
// use") corrupt lists when a node is polled or open while its gadget is bound to a controller
// again.

/// What the daemon tells the bridge, a message of one byte each.
enum class GadgetEvent : std::uint8_t {
  none,
  ready,   ///< it is there: the first message
  taken,   ///< the other computer takes reports
  nobody,  ///< there is no other computer, or it has not set the device up
  asleep,  ///< it does not ask for reports
  gone,    ///< the gadget was taken down
  led_off,
  led_on,
};

using OpenGadgetNode = std::function<OpenedNode()>;

/// Until the bridge is gone and nothing is owed. `link`: a SOCK_SEQPACKET whose messages are for
/// GadgetReports::put(); its end is the bridge's. `watch`: an inotify on the folder of device
/// nodes. `node` is open; `open` is asked after it has gone, whenever a node comes.
void run_gadget_daemon(GadgetFace face, UniqueFd link, UniqueFd watch, OpenedNode node,
                       OpenGadgetNode open) noexcept;

/// An inotify for the daemon. Throws ConfigError.
UniqueFd watch_nodes(const std::string& folder);

/// Everything at rest, and waits a moment until it is taken; not at all where nobody is plugged in.
void rest_gadget(int node, GadgetFace face) noexcept;

/// The same before a gadget goes. A bridge that writes to the node is made to rest and to let go of
/// it first: its node is removed, which a daemon takes for the end of the gadget.
void rest_before_the_end(const OpenedNode& node, GadgetFace face) noexcept;

}  // namespace tagwrench
