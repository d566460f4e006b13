#include <fmt/format.h>

#include <algorithm>
#include <span>

#include "host/board/board_session.h"
#include "protocol/codec.h"

namespace tagwrench::link {
namespace {

struct Name {
  std::uint32_t value;
  const char* text;
};

template <typename Value>
constexpr Name named(Value value, const char* text) {
  return {static_cast<std::uint32_t>(value), text};
}

constexpr Name kResetCauses[] = {
    named(ResetCause::unknown, "unknown cause"), named(ResetCause::power_on, "power on"),
    named(ResetCause::pin, "reset pin"), named(ResetCause::brown_out, "supply too low"),
    named(ResetCause::watchdog, "watchdog")};

constexpr Name kFaults[] = {
    named(FaultCode::none, "none"),
    named(FaultCode::host_silent, "host_silent"),
    named(FaultCode::led_limited, "led_limited"),
    named(FaultCode::cell_silent, "cell_silent"),
    named(FaultCode::cell_stuck, "cell_stuck"),
    named(FaultCode::supply_low, "supply_low"),
};

constexpr Name kResults[] = {
    named(Result::ok, "ok"),
    named(Result::unknown_kind, "it does not know this request"),
    named(Result::malformed, "the request was malformed"),
    named(Result::out_of_range, "a number is beyond its limits"),
    named(Result::wrong_version, "other protocol version"),
    named(Result::not_ready, "nothing is converted there; is the cell wired?"),
    named(Result::already_set, "it has one already"),
};

constexpr Name kRequests[] = {named(Kind::set_id, "to take an id"), named(Kind::tare, "to tare"),
                              named(Kind::time_request, "a time request")};

const char* find(std::span<const Name> names, std::uint32_t value, const char* none = "?") {
  const auto found = std::ranges::find(names, value, &Name::value);
  return found == names.end() ? none : found->text;
}

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
    case FaultCode::supply_low: return "board: its supply is low; use another cable or port";
    case FaultCode::none: break;
  }
  return fmt::format("board: fault {} on channel {}", news.value, news.other);
}

}  // namespace

const char* reset_cause_name(std::uint32_t cause) { return find(kResetCauses, cause); }
const char* fault_name(std::uint32_t code) { return find(kFaults, code); }
const char* result_name(std::uint32_t result) { return find(kResults, result); }

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
    case BoardEvent::Kind::id_given: return "board: it had no id and was given one";
    case BoardEvent::Kind::configuration_refused:
      return fmt::format("board: refused its configuration: {}", result_name(news.value));
    case BoardEvent::Kind::led_refused:
      return fmt::format("board: refused this light: {}; `tagwrench board info` shows the limits",
                         result_name(news.value));
    case BoardEvent::Kind::request_refused:
      return fmt::format("board: refused {}: {}", find(kRequests, news.value, "a request"),
                         result_name(news.other));
    case BoardEvent::Kind::other_host:
      return fmt::format("board: another program speaks to it too (session {:08x}); end it",
                         news.value);
    case BoardEvent::Kind::fault: return fault(news);
    case BoardEvent::Kind::unplugged:
      return "board: the port is gone; plug it in again, this program waits";
    case BoardEvent::Kind::plugged: return "board: the port is back";
  }
  return "?";
}

}  // namespace tagwrench::link
