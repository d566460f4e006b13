// What a CAD program sees of spacenavd. Runs until it is killed; prints
//   connected
//   motion TIME_ns X Y Z RX RY RZ
//   button TIME_ns NUMBER PRESSED
#include <poll.h>
#include <spnav.h>

#include "tests/kernel/guest/lines.h"

int main() {
  using tagwrench::rig::fail;
  using tagwrench::rig::now_ns;
  std::setvbuf(stdout, nullptr, _IOLBF, 0);
  if (spnav_open() == -1) fail("spacenavd does not answer");
  std::puts("connected");
  pollfd daemon{spnav_fd(), POLLIN, 0};
  while (::poll(&daemon, 1, -1) > 0 && (daemon.revents & POLLIN) != 0) {
    spnav_event event;
    while (spnav_poll_event(&event) != 0) {
      const long long time = now_ns();
      if (event.type == SPNAV_EVENT_MOTION) {
        const spnav_event_motion& m = event.motion;
        std::printf("motion %lld %d %d %d %d %d %d\n", time, m.x, m.y, m.z, m.rx, m.ry, m.rz);
      } else if (event.type == SPNAV_EVENT_BUTTON) {
        std::printf("button %lld %d %d\n", time, event.button.bnum, event.button.press);
      }
    }
  }
  fail("spacenavd went away");
}
