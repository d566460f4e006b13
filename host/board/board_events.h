// What happens on the link that a person should be told: data in the loop, a line of text outside.
#pragma once

#include <cstdint>
#include <string>

namespace tagwrench::link {

struct BoardEvent {
  enum class Kind : std::uint8_t {
    connected,              ///< value: protocol major << 8 | minor of the board
    restarted,              ///< the board started anew; value: ResetCause
    board_too_old,          ///< value: its protocol major << 8 | minor
    host_too_old,           ///< value: the board's protocol major << 8 | minor
    id_given,               ///< the board had no unique id
    configuration_refused,  ///< value: Result
    led_refused,            ///< value: Result
    request_refused,        ///< value: Kind of the request, other: Result
    other_host,             ///< value: the other session
    fault,                  ///< value: FaultCode, other: channel
    unplugged,
    plugged,
  };
  Kind kind = Kind::connected;
  std::uint32_t value = 0;
  std::uint32_t other = 0;
};

/// One line, remedy included where there is one.
std::string text(const BoardEvent& news);

const char* reset_cause_name(std::uint32_t reset_cause);
const char* fault_name(std::uint32_t fault_code);
const char* result_name(std::uint32_t result);

}  // namespace tagwrench::link
