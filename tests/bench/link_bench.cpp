// The board's firmware, its protocol and the link to it: sizes, times, losses and time stamps,
// each beside its target. What runs on the emulated board is in virtual time and does not depend on
// this machine; what runs on the host is told as a ratio to what the line carries.
#include <fmt/format.h>

#include <cmath>
#include <ctime>
#include <random>
#include <vector>

#include "host/board/board_session.h"
#include "protocol/codec.h"
#include "tests/bench/link_board.h"
#include "tests/bench/table.h"
#include "tests/unit/board/synthetic_link.h"

namespace tagwrench::bench {
namespace {

using Bytes = std::vector<std::uint8_t>;

double cpu_seconds() {
  timespec now{};
  ::clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + static_cast<double>(now.tv_nsec) * 1e-9;
}

template <class Message>
void append(Bytes& stream, const Message& message, std::uint8_t& sequence) {
  std::uint8_t body[link::kMaxBodyBytes];
  std::uint8_t frame[link::kMaxFrameBytes];
  const std::uint8_t count = link::encode(message, sequence++, body);
  const std::uint8_t bytes = link::write_frame(body, count, frame);
  stream.insert(stream.end(), frame, frame + bytes);
}

/// What a board sends in `seconds` under full load: 4 x 80 conversions, 2 x 100 ADC samples, 50
/// time replies and a status a second.
Bytes full_load(int seconds) {
  Bytes stream;
  std::uint8_t sequence = 0;
  std::mt19937 random(1);
  for (int tick = 0; tick < 1600 * seconds; ++tick) {  // of 1/1600 s
    const auto time_us = static_cast<std::uint32_t>(tick) * 625;
    if (tick % 5 == 0) {
      const auto channel = static_cast<std::uint8_t>(tick / 5 % 4);
      append(stream,
             link::CellSample{channel, static_cast<std::int32_t>(random() % 16000000) - 8000000,
                              time_us, static_cast<std::uint16_t>(tick / 20), 0, false},
             sequence);
    }
    if (tick % 8 == 0)
      append(stream,
             link::AdcSample{static_cast<std::uint8_t>(tick / 8 % 2),
                             static_cast<std::uint16_t>(random() % 1024), time_us,
                             static_cast<std::uint16_t>(tick / 16)},
             sequence);
    if (tick % 32 == 0)
      append(stream,
             link::TimeReply{static_cast<std::uint8_t>(tick / 32), time_us, 0, time_us, true},
             sequence);
  }
  return stream;
}

constexpr double kLineBytesPerSecond = link::kBaud / 10.0;

void bench_parser(Table& table) {
  constexpr int kSeconds = 60;
  const Bytes stream = full_load(kSeconds);
  table.open("host: bytes to samples",
             {fmt::format("{} s of full load, {:.0f} bytes/s; the line carries {:.0f}", kSeconds,
                          static_cast<double>(stream.size()) / kSeconds, kLineBytesPerSecond)});
  const double load = static_cast<double>(stream.size()) / kSeconds / kLineBytesPerSecond;
  table.at_most("part of the line that full load takes", load, 0.5, "");

  link::FrameReader reader;
  std::uint64_t frames = 0;
  double begin = cpu_seconds();
  for (const std::uint8_t byte : stream) frames += reader.take(byte) == link::Received::frame;
  const double parsing = cpu_seconds() - begin;
  table.line(fmt::format("frame parser: {:.1f} MB/s, {:.0f} ns a frame",
                         static_cast<double>(stream.size()) / parsing * 1e-6,
                         parsing / static_cast<double>(frames) * 1e9));
  table.at_least("frame parser, times the line's rate",
                 static_cast<double>(stream.size()) / parsing / kLineBytesPerSecond, 100, "x");

  auto session = std::make_unique<link::BoardSession>(link::BoardSessionOptions{});
  TimePoint now{std::chrono::seconds(100)};
  Bytes greeting;
  std::uint8_t sequence = 255;
  append(greeting,
         link::Hello{.protocol_major = link::kProtocolMajor,
                     .protocol_minor = link::kProtocolMinor,
                     .board = "bench",
                     .firmware = "0",
                     .unique_id = {{1}, 1},
                     .boot_id = 1,
                     .reset_cause = link::ResetCause::power_on,
                     .session = 0},
         sequence);
  session->take(greeting, now);
  begin = cpu_seconds();
  constexpr std::size_t kChunk = 64;  // as a USB adapter delivers
  std::uint8_t out[link::BoardSession::kMaxBytesOut];
  std::size_t taken = 0;
  for (std::size_t at = 0; at < stream.size(); at += kChunk) {
    now += std::chrono::microseconds(20 * kChunk * 5);
    session->take({stream.data() + at, std::min(kChunk, stream.size() - at)}, now);
    session->poll(now, out);
    for (link::CellReading r; session->next(r);) ++taken;
    for (link::AdcReading r; session->next(r);) ++taken;
  }
  const double all = cpu_seconds() - begin;
  table.line(fmt::format("session: {:.2f} us a frame", all / static_cast<double>(frames) * 1e6));
  table.at_least("samples that came out of it", static_cast<double>(taken), 520.0 * kSeconds, "");
  table.at_most("processor time of the link in the bridge, of one core", 100 * all / kSeconds, 1,
                "%");
}

/// How far a stream of full load is read again after damage.
void bench_resync(Table& table) {
  const Bytes clean = full_load(4);
  std::mt19937 random(7);
  table.open("host: damage on the line",
             {"one bit in 1,000 flipped; one byte dropped; one inserted"});
  Bytes noisy = clean;
  std::bernoulli_distribution flips(1e-3);
  for (std::uint8_t& byte : noisy) {
    for (int bit = 0; bit < 8; ++bit) {
      if (flips(random)) byte = static_cast<std::uint8_t>(byte ^ (1U << bit));
    }
  }
  const auto good = [](const Bytes& stream) {
    link::FrameReader reader;
    std::uint64_t frames = 0;
    for (const std::uint8_t byte : stream) frames += reader.take(byte) == link::Received::frame;
    return frames;
  };
  const auto all = static_cast<double>(good(clean));
  const double mean_bits = 8.0 * static_cast<double>(clean.size()) / all;
  table.line(fmt::format(
      "1 bit in 1,000 flipped: {:.1f} % of the frames come through; {:.1f} % have "
      "no flipped bit",
      100 * static_cast<double>(good(noisy)) / all, 100 * std::pow(1 - 1e-3, mean_bits)));

  double worst_lost = 0;
  for (std::size_t at = 0; at < 2000; ++at) {
    Bytes cut(clean.begin(), clean.begin() + 4000);
    const auto before = static_cast<double>(good(cut));
    cut.erase(cut.begin() + static_cast<std::ptrdiff_t>(at));
    worst_lost = std::max(worst_lost, before - static_cast<double>(good(cut)));
    cut.insert(cut.begin() + static_cast<std::ptrdiff_t>(at), 2, 0x55);
    worst_lost = std::max(worst_lost, before - static_cast<double>(good(cut)));
  }
  table.at_most("frames lost by one byte dropped or inserted, worst of 2,000 places", worst_lost, 2,
                "frames");
}

struct ClockErrors {
  double rms_us = 0, worst_us = 0, normalised = 0, converged_s = 0;
};

/// 20 boards, 45 s, ten exchanges a second; board times of the last 100 ms, asked after 10 s.
ClockErrors clock_errors(const link::PathDelays& path) {
  constexpr unsigned kBoards = 20;
  ClockErrors out;
  double squares = 0, normal = 0;
  int asked_times = 0;
  for (unsigned seed = 0; seed < kBoards; ++seed) {
    link::SyntheticLink line(100 + seed, path, seed % 2 == 0 ? -40e-6 : 3000e-6);
    link::ClockSync clock;
    double converged = 45;
    double end = 0;
    const double start = link::SyntheticLink::kStart;
    for (double t = start + 0.1; t < start + 45; t += 0.09 + 0.02 * line.draw()) {
      clock.add(line.exchange(t, end));
      if (clock.report().converged) converged = std::min(converged, t - start);
      if (t < start + 10) continue;
      const double asked = end - 0.1 * line.draw();
      const link::HostTime told = clock.to_host(line.board_us(asked));
      const double error =
          link::SyntheticLink::seconds(told.time - link::SyntheticLink::host(asked));
      squares += error * error;
      normal += std::pow(error / link::SyntheticLink::seconds(told.sigma), 2);
      out.worst_us = std::max(out.worst_us, std::abs(error) * 1e6);
      ++asked_times;
    }
    out.converged_s += converged / kBoards;
  }
  out.rms_us = std::sqrt(squares / asked_times) * 1e6;
  out.normalised = std::sqrt(normal / asked_times);
  return out;
}

void bench_clock(Table& table) {
  table.open("clock synchronisation on synthetic paths",
             {"20 boards, 45 s, 10 exchanges/s, skew -40 or 3000 ppm, 2 ppm wander"});
  struct Case {
    const char* name;
    link::PathDelays path;
    double limit_us;
  };
  const Case cases[] = {
      {"0.125 ms of jitter either way", {.jitter = 0.125e-3}, 50},
      {"1 ms of jitter either way", {.jitter = 1e-3}, 50},
      {"1 ms of jitter on the way back", {.jitter = 1e-3, .jitter_there = false}, 50},
      {"16 ms (a slow adapter) on the way back",
       {.jitter = 16e-3, .tail_share = 0, .jitter_there = false},
       INFINITY},
  };
  for (const Case& c : cases) {
    const ClockErrors errors = clock_errors(c.path);
    table.line(
        fmt::format("{}: rms {:.1f} us, worst {:.0f} us, error over sigma {:.2f}, converged "
                    "after {:.1f} s",
                    c.name, errors.rms_us, errors.worst_us, errors.normalised, errors.converged_s));
    if (std::isfinite(c.limit_us))
      table.at_most(std::string("  rms, ") + c.name, errors.rms_us, c.limit_us, "us");
    table.at_most(std::string("  error over stated sigma, ") + c.name, errors.normalised, 1.2, "");
  }
}

}  // namespace
}  // namespace tagwrench::bench

int main() {
  tagwrench::bench::Table table;
  tagwrench::bench::bench_emulated_board(table);
  tagwrench::bench::bench_parser(table);
  tagwrench::bench::bench_resync(table);
  tagwrench::bench::bench_clock(table);
  table.close();
  return 0;
}
