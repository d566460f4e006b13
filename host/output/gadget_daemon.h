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
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <string>

#include "host/core/os/unique_fd.h"
#include "host/output/gadget_kernel.h"
#include "host/output/gadget_reports.h"

namespace tagwrench {

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

class GadgetDaemon {
 public:
  using OpenNode = std::function<OpenedNode()>;

  /// `link`: a SOCK_SEQPACKET whose messages are for GadgetReports::put(); its end is the bridge's.
  /// `watch`: an inotify on the folder of device nodes. `node` is open; `open` is asked after it
  /// has gone, whenever a node comes.
  GadgetDaemon(GadgetFace face, UniqueFd link, UniqueFd watch, OpenedNode node, OpenNode open);

  /// Until the bridge is gone and nothing is owed.
  void run() noexcept;

 private:
  using Clock = std::chrono::steady_clock;

  void flush() noexcept;
  void refused(int error) noexcept;
  int patience_ms() const noexcept;
  void wait() noexcept;
  void take_link() noexcept;
  void take_output() noexcept;
  void take_watch() noexcept;
  void lose_node() noexcept;
  void find_node() noexcept;
  void tell_state(GadgetEvent state) noexcept;
  void tell_bridge(GadgetEvent status_line) noexcept;

  GadgetFace face_;
  GadgetReports reports_;
  UniqueFd link_;
  UniqueFd watch_;
  OpenedNode node_;
  OpenNode open_;
  bool ended_ = false;    ///< the bridge is gone
  bool away_ = false;     ///< nobody takes reports: nothing can be stuck
  bool free_ = false;     ///< poll() has said that a write is possible
  bool pause_ = false;    ///< and it was not: not to be asked again at once
  bool readable_ = true;  ///< false after an error, until a report is taken
  bool waiting_ = false;  ///< a report was refused because there is one before it
  Clock::time_point waiting_since_{};
  GadgetEvent state_ = GadgetEvent::none;
  GadgetEvent led_ = GadgetEvent::led_off;
};

/// An inotify for the daemon. Throws ConfigError.
UniqueFd watch_nodes(const std::string& folder);

/// Everything at rest, and waits a moment until it is taken; not at all where nobody is plugged in.
void rest_gadget(int node, GadgetFace face) noexcept;

/// The same before a gadget goes. A bridge that writes to the node is made to rest and to let go of
/// it first: its node is removed, which a daemon takes for the end of the gadget.
void rest_before_the_end(const OpenedNode& node, GadgetFace face) noexcept;

}  // namespace tagwrench
