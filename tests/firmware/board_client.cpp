#include "tests/firmware/board_client.h"

namespace tagwrench::emulator {

void BoardClient::run(VirtualTime duration, VirtualTime step) {
  run_until(board_.now() + duration, step);
}

void BoardClient::run_until(VirtualTime time, VirtualTime step) {
  while (board_.now() < time) {
    board_.advance_to(std::min(time, board_.now() + step));
    take_in();
  }
}

bool BoardClient::run_while_not(const std::function<bool()>& condition, VirtualTime most) {
  const VirtualTime end = board_.now() + most;
  while (!condition()) {
    if (board_.now() >= end) return false;
    run(std::chrono::microseconds(200));
  }
  return true;
}

std::optional<link::Hello> BoardClient::greet(std::uint32_t session) {
  const std::size_t capabilities = all<link::Capabilities>().size();
  const std::size_t hellos = all<link::Hello>().size();
  for (int attempt = 0; attempt < 8; ++attempt) {
    send(link::HelloRequest{link::kProtocolMajor, link::kProtocolMinor, session});
    const bool came = run_while_not(
        [&] {
          return all<link::Capabilities>().size() > capabilities &&
                 all<link::Hello>().size() > hellos;
        },
        std::chrono::milliseconds(250));
    if (came) return all<link::Hello>().back().message;
  }
  return std::nullopt;
}

void BoardClient::forget() {
  std::apply([](auto&... lists) { (lists.clear(), ...); }, reports_);
}

void BoardClient::take_in() {
  for (const SentByte& byte : board_.read()) {
    ++bytes_;
    if (!frame_begin_) frame_begin_ = byte.begin;
    const link::Received received = reader_.take(byte.value);
    if (received == link::Received::frame) take_frame(byte.end);
    if (byte.value == 0) frame_begin_.reset();
  }
}

template <typename Message>
void BoardClient::keep(VirtualTime end) {
  Arrived<Message> arrived;
  arrived.sequence = reader_.sequence();
  arrived.begin = *frame_begin_;
  arrived.end = end;
  if (link::decode(reader_.message(), reader_.message_bytes(), arrived.message)) {
    all<Message>().push_back(arrived);
  } else {
    ++undecodable_;
  }
}

void BoardClient::take_frame(VirtualTime end) {
  ++frames_;
  if (heard_sequence_) {
    const auto expected = static_cast<std::uint8_t>(*heard_sequence_ + 1);
    gaps_ += static_cast<std::uint8_t>(reader_.sequence() - expected);
  }
  heard_sequence_ = reader_.sequence();
  switch (static_cast<link::Kind>(reader_.kind())) {
    case link::Kind::hello: return keep<link::Hello>(end);
    case link::Kind::capabilities: return keep<link::Capabilities>(end);
    case link::Kind::cell_sample: return keep<link::CellSample>(end);
    case link::Kind::adc_sample: return keep<link::AdcSample>(end);
    case link::Kind::button_event: return keep<link::ButtonEvent>(end);
    case link::Kind::time_reply: return keep<link::TimeReply>(end);
    case link::Kind::status: return keep<link::Status>(end);
    case link::Kind::answer: return keep<link::Answer>(end);
    case link::Kind::tare_result: return keep<link::TareResult>(end);
    case link::Kind::fault: return keep<link::Fault>(end);
    default: ++undecodable_;
  }
}

link::Configure full_configuration() {
  link::Configure configuration{};
  configuration.host_timeout_ms = 5000;
  configuration.cell_count = link::kMaxCells;
  for (link::CellInput& input : configuration.cells) input = link::CellInput::a128;
  configuration.cell_rate_sps = 80;
  configuration.adc_mask = 3;
  configuration.adc_rate_hz = 100;
  configuration.status_period_ms = 1000;
  return configuration;
}

std::int64_t unwrap_us(std::uint32_t stamp_us, std::int64_t near_us) {
  return near_us + static_cast<std::int32_t>(stamp_us - static_cast<std::uint32_t>(near_us));
}

}  // namespace tagwrench::emulator
