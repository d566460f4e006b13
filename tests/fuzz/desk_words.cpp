// Any bytes as what other programs of the desktop say: i3's IPC in any pieces, requests and answers
// of `tagwrench control`, and what a job of the pages prints.
#include <algorithm>
#include <cmath>
#include <string>
#include <string_view>

#include "host/motion/control_socket.h"
#include "host/motion/focus_watch.h"
#include "host/motion/profile_manager.h"
#include "host/web/bridge/control_link.h"
#include "host/web/bridge/job_command.h"
#include "tests/fuzz/expect.h"

namespace {

using namespace tagwrench;

void i3(std::string_view bytes) {
  I3Stream stream;
  while (!bytes.empty()) {
    const std::size_t piece =
        std::min<std::size_t>(1 + static_cast<unsigned char>(bytes[0]) % 50, bytes.size());
    if (!stream.put(bytes.substr(0, piece))) return;
    while (const std::optional<I3Message> message = stream.next()) {
      expect(message->payload.size() <= I3Stream::kMax, "a payload is bounded");
      focus_in(*message);
    }
    bytes.remove_prefix(piece);
  }
}

void payload(std::string_view bytes) {
  for (const I3Type type : {I3Type::tree, I3Type::window_event})
    focus_in({static_cast<std::uint32_t>(type), std::string(bytes)});
}

void control(std::string_view bytes) {
  using Kind = ControlRequest::Kind;
  const ControlRequest request = parse_request(bytes);
  expect(request.kind != Kind::none, "bytes are a request, known or not");
  if (request.kind == Kind::profile || request.kind == Kind::attempt)
    expect(!request.name.empty(), "a profile has a name");
  expect(request.text.empty() || request.kind == Kind::attempt, "only a trial has a text");
  control_answer(bytes);
  if (const std::optional<LiveReading> live = parse_live(bytes)) parse_live(live_text(*live));
}

void job(std::string_view bytes) {
  JobReport report("doctor", {"tilt", "shift"});
  while (!bytes.empty()) {
    const std::string_view line = bytes.substr(0, bytes.find('\n'));
    report.said(line);
    report.printed(line);
    if (const std::optional<JobPicture> picture = report.event(line))
      expect(picture->width > 0 && picture->height > 0, "a picture has a size");
    bytes.remove_prefix(std::min(line.size() + 1, bytes.size()));
  }
  expect(report.state() == JobReport::State::running, "a line ends no job");
  report.to_json().dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

constexpr void (*kReaders[])(std::string_view bytes) = {i3, payload, control, job};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t count) {
  if (count == 0) return 0;
  const std::string own(reinterpret_cast<const char*>(bytes) + 1, count - 1);
  kReaders[bytes[0] % std::size(kReaders)](own);
  return 0;
}
