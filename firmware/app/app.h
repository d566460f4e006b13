// All behaviour of the board: a board's main() makes one App and polls it for ever.
#pragma once

#include "firmware/app/adc.h"
#include "firmware/app/buttons.h"
#include "firmware/app/faults.h"
#include "firmware/app/led.h"
#include "firmware/app/link.h"
#include "firmware/app/load_cell.h"

namespace tagwrench {
namespace firmware {

class App {
 public:
  explicit App(uint32_t now_us) : led_(now_us), polled_us_(now_us) {}
  /// Does a small part of what is to be done; to be called again at once.
  void poll(uint32_t now_us);

 private:
  void measure_loop(uint32_t now_us);
  void watch_host(uint32_t now_us);
  void handle_request(uint32_t now_us);
  link::Result handle(uint8_t kind, uint32_t now_us);
  void handle_hello(uint32_t now_us);
  link::Result configure(uint32_t now_us);
  link::Result set_led(uint32_t now_us);
  link::Result tare();
  link::Result set_id();
  void send_slow_report(uint32_t now_us);
  void send_hello();
  void send_capabilities();
  void send_status(uint32_t now_us);
  void watch_supply(uint16_t supply_mv, uint32_t now_us);

  Link link_;
  LedDriver led_;
  LoadCells cells_;
  Adc adc_;
  Buttons buttons_;
  Faults faults_;

  uint32_t polled_us_;
  uint32_t longest_loop_us_ = 0;
  uint32_t heard_us_ = 0;   ///< last valid frame
  uint32_t status_us_ = 0;  ///< last Status
  uint32_t session_ = 0;
  uint16_t host_timeout_ms_ = 5000;
  uint16_t status_period_ms_ = 1000;
  uint16_t unknown_kinds_ = 0;
  bool host_there_ = false;
  bool greeted_ = false;  ///< by a host since the start, of any version
  bool refused_ = false;  ///< the last host that greeted has another major version
  bool hello_due_ = false;
  bool capabilities_due_ = false;
  bool supply_low_ = false;
};

}  // namespace firmware
}  // namespace tagwrench
