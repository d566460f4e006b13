#include <fmt/format.h>

#include "host/board/board_session.h"
#include "protocol/codec.h"

namespace tagwrench::link {
namespace {

std::string version(std::uint32_t packed) {
  return fmt::format("{}.{}", packed >> 8, packed & 0xFF);
}

std::string fault(const BoardEvent& news) {
  switch (static_cast<FaultCode>(news.value)) {
    case FaultCode::host_silent:
      return "board: heard nothing from here for its host timeout and switched the LED off";
    case FaultCode::led_limited:
      return "board: the LED was lowered to the level that it can stand for ever";
    case FaultCode::cell_silent:
      return fmt::format(
          "board: load cell {} does not answer; check the wires of its amplifier (DOUT, SCK, "
          "power)",
          news.other);
    case FaultCode::cell_stuck:
      return fmt::format(
          "board: the data line of load cell {} never goes high; check its amplifier for a short",
          news.other);
    case FaultCode::supply_low:
      return "board: its supply is low; use another cable or port";
    case FaultCode::none:
      break;
  }
  return fmt::format("board: fault {} on channel {}", news.value, news.other);
}

const char* request_name(std::uint32_t kind) {
  switch (static_cast<Kind>(kind)) {
    case Kind::set_id:
      return "to take an id";
    case Kind::tare:
      return "to tare";
    case Kind::time_request:
      return "a time request";
    default:
      return "a request";
  }
}

}  // namespace

const char* reset_cause_name(std::uint32_t reset_cause) {
  switch (static_cast<ResetCause>(reset_cause)) {
    case ResetCause::unknown:
      return "unknown cause";
    case ResetCause::power_on:
      return "power on";
    case ResetCause::pin:
      return "reset pin";
    case ResetCause::brown_out:
      return "supply too low";
    case ResetCause::watchdog:
      return "watchdog";
  }
  return "?";
}

const char* fault_name(std::uint32_t fault_code) {
  switch (static_cast<FaultCode>(fault_code)) {
    case FaultCode::none:
      return "none";
    case FaultCode::host_silent:
      return "host_silent";
    case FaultCode::led_limited:
      return "led_limited";
    case FaultCode::cell_silent:
      return "cell_silent";
    case FaultCode::cell_stuck:
      return "cell_stuck";
    case FaultCode::supply_low:
      return "supply_low";
  }
  return "?";
}

const char* result_name(std::uint32_t result) {
  switch (static_cast<Result>(result)) {
    case Result::ok:
      return "ok";
    case Result::unknown_kind:
      return "it does not know this request";
    case Result::malformed:
      return "the request was malformed";
    case Result::out_of_range:
      return "a number is beyond its limits";
    case Result::wrong_version:
      return "other protocol version";
    case Result::not_ready:
      return "nothing is converted there; is the cell wired?";
    case Result::already_set:
      return "it has one already";
  }
  return "?";
}

std::string text(const BoardEvent& news) {
  switch (news.kind) {
    case BoardEvent::Kind::connected:
      return fmt::format("board: connected, protocol {}", version(news.value));
    case BoardEvent::Kind::restarted:
      return fmt::format("board: it started anew ({}); configured again",
                         reset_cause_name(news.value));
    case BoardEvent::Kind::board_too_old:
      return fmt::format(
          "board: its firmware speaks protocol {}, this program {}.{}; update the board: "
          "`tagwrench board flash`",
          version(news.value), kProtocolMajor, kProtocolMinor);
    case BoardEvent::Kind::host_too_old:
      return fmt::format(
          "board: its firmware speaks protocol {}, this program {}.{}; update tagwrench on this "
          "computer",
          version(news.value), kProtocolMajor, kProtocolMinor);
    case BoardEvent::Kind::id_given:
      return "board: it had no id and was given one";
    case BoardEvent::Kind::configuration_refused:
      return fmt::format("board: refused its configuration: {}", result_name(news.value));
    case BoardEvent::Kind::led_refused:
      return fmt::format("board: refused this light: {}; `tagwrench board info` shows the limits",
                         result_name(news.value));
    case BoardEvent::Kind::request_refused:
      return fmt::format("board: refused {}: {}", request_name(news.value),
                         result_name(news.other));
    case BoardEvent::Kind::other_host:
      return fmt::format("board: another program speaks to it too (session {:08x}); end it",
                         news.value);
    case BoardEvent::Kind::fault:
      return fault(news);
    case BoardEvent::Kind::unplugged:
      return "board: the port is gone; plug it in again, this program waits";
    case BoardEvent::Kind::plugged:
      return "board: the port is back";
  }
  return "?";
}

}  // namespace tagwrench::link
