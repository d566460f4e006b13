#include "tests/firmware/full_load.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "tests/firmware/avr_registers.h"
#include "tests/firmware/board_client.h"

namespace tagwrench::emulator {

namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr VirtualTime kExchangePeriod = milliseconds(20);
constexpr unsigned kExchangesPerSecond = 50;
/// A sample belongs to the event within this of its stamp.
constexpr double kMatchUs = 2000;

double us_of(VirtualTime time) { return static_cast<double>(time.count()) * 1e-3; }

class Errors {
 public:
  void add(double error_us) {
    ++result_.samples;
    sum_ += error_us;
    squares_ += error_us * error_us;
    result_.worst_us = std::max(result_.worst_us, std::abs(error_us));
  }
  StampError result() const {
    StampError all = result_;
    if (all.samples > 0) {
      all.bias_us = sum_ / static_cast<double>(all.samples);
      all.rms_us = std::sqrt(squares_ / static_cast<double>(all.samples));
    }
    return all;
  }

 private:
  StampError result_;
  double sum_ = 0;
  double squares_ = 0;
};

/// The event nearest to a time, of a list sorted by time; -1 if none is near.
template <typename Event, typename TimeOf>
std::ptrdiff_t nearest(const std::vector<Event>& events, VirtualTime time, TimeOf time_of) {
  const auto after =
      std::lower_bound(events.begin(), events.end(), time,
                       [&](const Event& event, VirtualTime t) { return time_of(event) < t; });
  std::ptrdiff_t best = -1;
  double least = kMatchUs;
  for (auto event : {after == events.begin() ? after : after - 1, after}) {
    if (event == events.end()) continue;
    const double distance = std::abs(us_of(time_of(*event) - time));
    if (distance < least) {
      least = distance;
      best = event - events.begin();
    }
  }
  return best;
}

void connect_signals(EmulatedBoard& board) {
  for (unsigned i = 0; i < kCells; ++i) {
    board.cell(i).bridge().noise_counts = 30;
    board.cell(i).bridge().force = [i](VirtualTime t) {
      return 2.0 * std::sin(us_of(t) * 1e-6 * (1.3 + i));
    };
  }
  for (std::uint8_t i = 0; i < 2; ++i) {
    board.adc().set_input(static_cast<std::uint8_t>(4 + i), [i](VirtualTime t) {
      return 2.5 + 2.0 * std::sin(us_of(t) * 1e-6 * (2.1 + i));
    });
  }
}

struct Exchange {
  Sent request;
  std::optional<Arrived<link::TimeReply>> reply;
};

void judge_cells(BoardClient& client, FullLoadFigures& figures) {
  EmulatedBoard& board = client.board();
  Errors errors;
  for (std::uint8_t channel = 0; channel < kCells; ++channel) {
    const auto& truth = board.cell(channel).conversions();
    std::ptrdiff_t first = -1;
    std::ptrdiff_t last = -1;
    std::uint64_t matched = 0;
    for (const auto& sample : client.all<link::CellSample>()) {
      if (sample.message.channel != channel) continue;
      const std::int64_t stamp =
          unwrap_us(sample.message.time_us, std::llround(us_of(sample.end - board.clock_zero())));
      const VirtualTime stamped = board.true_time(stamp);
      const auto which =
          nearest(truth, stamped, [](const Conversion& conversion) { return conversion.ready; });
      ++figures.cell_samples;
      if (which < 0) {
        ++figures.cell_wrong;
        continue;
      }
      const Conversion& conversion = truth[static_cast<std::size_t>(which)];
      if (conversion.counts != sample.message.counts || which == last) ++figures.cell_wrong;
      if (first < 0) first = which;
      last = which;
      ++matched;
      errors.add(us_of(stamped - conversion.ready));
    }
    if (first < 0) throw std::runtime_error("a cell's samples did not arrive");
    const auto made = static_cast<std::uint64_t>(last - first + 1);
    figures.cell_conversions += made;
    figures.cell_lost += made - matched;
    const CycleCount& reads = board.cell(channel).reads();
    figures.cell_read_mean_us += reads.mean() / 16 / kCells;
    figures.cell_read_worst_us =
        std::max(figures.cell_read_worst_us, static_cast<double>(reads.worst) / 16);
  }
  figures.cell_stamp = errors.result();
}

void judge_adc(BoardClient& client, const std::vector<AdcConversion>& truth,
               FullLoadFigures& figures) {
  EmulatedBoard& board = client.board();
  Errors errors;
  Errors spacing;
  for (std::uint8_t channel = 0; channel < 2; ++channel) {
    std::vector<double> starts;
    std::uint16_t next = 0;
    bool began = false;
    for (const auto& sample : client.all<link::AdcSample>()) {
      if (sample.message.channel != channel) continue;
      if (began) figures.adc_lost += static_cast<std::uint16_t>(sample.message.sequence - next);
      began = true;
      next = static_cast<std::uint16_t>(sample.message.sequence + 1);
      ++figures.adc_samples;
      const std::int64_t stamp =
          unwrap_us(sample.message.time_us, std::llround(us_of(sample.end - board.clock_zero())));
      const VirtualTime stamped = board.true_time(stamp);
      const auto which = nearest(
          truth, stamped, [](const AdcConversion& conversion) { return conversion.trigger; });
      if (which < 0 || truth[static_cast<std::size_t>(which)].channel != 4 + channel ||
          truth[static_cast<std::size_t>(which)].counts != sample.message.counts) {
        ++figures.adc_wrong;
        continue;
      }
      const VirtualTime trigger = truth[static_cast<std::size_t>(which)].trigger;
      errors.add(us_of(stamped - trigger));
      starts.push_back(us_of(trigger));
    }
    if (starts.size() < 3) throw std::runtime_error("an ADC channel's samples did not arrive");
    const double period = (starts.back() - starts.front()) / static_cast<double>(starts.size() - 1);
    for (std::size_t i = 0; i < starts.size(); ++i)
      spacing.add(starts[i] - starts.front() - period * static_cast<double>(i));
  }
  figures.adc_stamp = errors.result();
  figures.adc_spacing_rms_us = spacing.result().rms_us;
}

void judge_times(BoardClient& client, const std::vector<Sent>& requests, FullLoadFigures& figures) {
  EmulatedBoard& board = client.board();
  const auto true_time = [&](std::uint32_t stamp_us, VirtualTime near) {
    return board.true_time(unwrap_us(stamp_us, std::llround(us_of(near - board.clock_zero()))));
  };
  Errors received;
  Errors sent;
  std::size_t at = 0;
  std::optional<Arrived<link::TimeReply>> before;
  for (const auto& reply : client.all<link::TimeReply>()) {
    while (at < requests.size() && requests[at].sequence != reply.message.request_sequence) ++at;
    if (at == requests.size()) break;
    ++figures.time_replies;
    received.add(us_of(true_time(reply.message.received_us, reply.end) - requests[at].end));
    if (before && reply.message.previous_valid &&
        reply.message.previous_request_sequence == before->message.request_sequence)
      sent.add(us_of(true_time(reply.message.previous_sent_us, reply.end) - before->begin));
    before = reply;
  }
  figures.time_requests = requests.size();
  figures.time_received = received.result();
  figures.time_sent = sent.result();
}

void judge_core(EmulatedBoard& board, Cycle begin, FullLoadFigures& figures) {
  const CoreFigures& core = board.figures();
  const auto us = [](std::uint64_t cycles) { return static_cast<double>(cycles) / 16; };
  for (std::size_t vector = 0; vector < core.latency.size(); ++vector) {
    figures.longest_handler_us =
        std::max(figures.longest_handler_us, us(core.duration[vector].worst));
    if (vector != reg::kUsartDataEmpty)
      figures.worst_latency_us = std::max(figures.worst_latency_us, us(core.latency[vector].worst));
  }
  figures.worst_receive_latency_us = us(core.latency[reg::kUsartRx].worst);
  figures.longest_loop_us = us(core.loop.worst);
  figures.mean_loop_us = core.loop.mean() / 16;
  figures.interrupt_load = static_cast<double>(core.interrupt_cycles) /
                           static_cast<double>(board.core().cycle() - begin);
  figures.flash_bytes = board.core().sizes().flash_bytes;
  figures.static_ram_bytes = board.core().sizes().static_bytes;
  figures.stack_used_bytes = board.stack_used_bytes();
  figures.stack_free_bytes = board.stack_free_bytes();
  figures.calls = board.core().calls();
}

}  // namespace

FullLoadFigures run_full_load(const std::filesystem::path& elf, const FullLoadOptions& options) {
  const auto wall = std::chrono::steady_clock::now();
  BoardOptions board_options;
  board_options.clock_ppm = options.clock_ppm;
  EmulatedBoard board(elf, board_options);
  connect_signals(board);
  BoardClient client(board);
  if (!client.greet()) throw std::runtime_error("the emulated board does not answer");
  if (client.ask(full_configuration()) != link::Result::ok)
    throw std::runtime_error("the emulated board refuses its configuration");
  link::Led strobe{};
  strobe.mode = link::LedMode::strobe;
  strobe.period_us = options.strobe_period_us;
  strobe.width_us = 100;
  if (options.strobe_period_us != 0 && client.ask(strobe) != link::Result::ok)
    throw std::runtime_error("the emulated board refuses the strobe");
  // Settled amplifiers, and nothing of the start counted.
  client.run(milliseconds(500));
  client.forget();
  for (unsigned i = 0; i < kCells; ++i) board.cell(i).forget_conversions();
  board.adc().take_conversions();
  for (const std::string& function : options.functions) board.core().count_calls(function);
  board.core().watch_every_instruction(true);
  board.core().clear_figures();

  FullLoadFigures figures;
  const std::uint64_t bytes_before = client.bytes();
  const std::uint64_t frames_before = client.frames();
  const Cycle begin = board.core().cycle();
  const VirtualTime start = board.now();
  std::vector<Sent> requests;
  const auto exchanges = static_cast<unsigned>(options.seconds * kExchangesPerSecond);
  for (unsigned i = 0; i < exchanges; ++i) {
    requests.push_back(client.send(link::TimeRequest{}));
    if (i % (kExchangesPerSecond / 10) == 0) {
      for (unsigned k = 0; k < options.burst; ++k) client.send(link::Tare{});
      figures.burst_requests += options.burst;
    }
    // A little off the even grid, so that requests meet every phase of the board's other work.
    client.run_until(start + (i + 1) * kExchangePeriod + VirtualTime(i % 97 * 13000));
  }
  client.run(milliseconds(10));

  figures.seconds = us_of(board.now() - start) * 1e-6;
  figures.frames = client.frames() - frames_before;
  figures.bytes_per_second = static_cast<double>(client.bytes() - bytes_before) / figures.seconds;
  figures.damaged_frames = client.damaged() + client.undecodable();
  figures.sequence_gaps = client.sequence_gaps();
  figures.burst_answers = client.all<link::Answer>().size();
  figures.receiver_overruns = board.usart().overruns();
  judge_cells(client, figures);
  judge_adc(client, board.adc().take_conversions(), figures);
  judge_times(client, requests, figures);
  judge_core(board, begin, figures);
  if (!client.all<link::Status>().empty()) {
    const link::Status& status = client.all<link::Status>().back().message;
    figures.reported_dropped = status.dropped_reports;
    figures.reported_overruns = status.overruns;
    figures.reported_longest_loop_us = status.longest_loop_us;
    figures.reported_stack_free_bytes = status.stack_free_bytes;
  }
  figures.wall_seconds =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - wall).count();
  return figures;
}

}  // namespace tagwrench::emulator
