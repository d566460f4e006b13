// A model of a board on a pseudo-terminal, served by a thread of the test in real time.
#pragma once

#include <atomic>
#include <condition_variable>
#include <functional>
#include <mutex>
#include <thread>

#include "tests/unit/board/board_model.h"
#include "tests/unit/board/pty.h"

namespace tagwrench::link {

class ServedBoard {
 public:
  /// `prepare` changes the model before it is served. Load cells `wired` (a mask) send samples.
  explicit ServedBoard(std::uint8_t wired = 0xF,
                       const std::function<void(BoardModel&)>& prepare = {})
      : clock_(1, {}, 300e-6), model_(clock_), wired_(wired) {
    model_.capabilities.adc_channels = 2;
    model_.capabilities.adc_bits = 10;
    model_.capabilities.buttons = 2;
    model_.capabilities.led_sustained_permille = 300;
    model_.capabilities.led_full_time_ms = 10'000;
    model_.capabilities.measures_supply = true;
    if (prepare) prepare(model_);
    thread_ = std::thread([this] { serve(); });
  }
  ServedBoard(const ServedBoard&) = delete;
  ServedBoard& operator=(const ServedBoard&) = delete;
  ~ServedBoard() {
    stop_ = true;
    thread_.join();
  }

  const std::string& path() const { return device_.path(); }
  void set_counts(std::int32_t counts) { counts_ = counts; }
  void press() { press_ = true; }

  /// Looks at the model until it is as wanted; false if it never is.
  bool wait_for(const std::function<bool(const BoardModel&)>& wanted) {
    std::unique_lock lock(mutex_);
    return served_.wait_for(lock, std::chrono::seconds(20), [&] { return wanted(model_); });
  }

 private:
  static double now() {
    return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch())
        .count();
  }

  void serve() {
    double next_sample = now();
    double next_status = now();
    while (!stop_) {
      pollfd entry{device_.fd(), POLLIN, 0};
      ::poll(&entry, 1, 5);
      const std::lock_guard lock(mutex_);
      model_.take(device_.read(), now());
      if (model_.configured && now() >= next_sample) {
        send_samples();
        next_sample = std::max(next_sample + 1.0 / 80, now() - 0.1);
      }
      if (model_.configured && now() >= next_status) {
        Status status{};
        status.time_us = clock_.board_us(now());
        status.session = model_.hello.session;
        status.supply_mv = 5020;
        model_.send(status);
        next_status = now() + 0.5;
      }
      // Without a reader the terminal fills up, as a cable does that ends nowhere.
      const auto out = model_.take_out();
      [[maybe_unused]] const ssize_t written = ::write(device_.fd(), out.data(), out.size());
      served_.notify_all();
    }
  }

  void send_samples() {
    for (std::uint8_t channel = 0; channel < kMaxCells; ++channel) {
      if ((wired_ >> channel & 1) != 0) {
        model_.send_cell(channel, counts_ + 10 * channel + (sequence_ % 3) - 1, now(), sequence_);
      } else if (!fault_sent_) {
        model_.send(Fault{FaultCode::cell_silent, channel, clock_.board_us(now())});
      }
    }
    fault_sent_ = true;
    if (press_.exchange(false)) model_.send(ButtonEvent{1, true, clock_.board_us(now()), 0});
    ++sequence_;
  }

  SyntheticLink clock_;
  BoardModel model_;
  Pty device_;
  std::uint8_t wired_;
  std::uint16_t sequence_ = 0;
  bool fault_sent_ = false;
  std::atomic<std::int32_t> counts_{0};
  std::atomic<bool> press_{false};
  std::atomic<bool> stop_{false};
  std::mutex mutex_;
  std::condition_variable served_;
  std::thread thread_;
};

}  // namespace tagwrench::link
