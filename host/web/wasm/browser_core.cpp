// The core as a page calls it: plain C, numbers and texts in the core's memory. core.ts wraps it.
#include <algorithm>
#include <chrono>
#include <exception>
#include <map>
#include <memory>
#include <new>
#include <string>
#include <utility>
#include <vector>

#include "host/web/wasm/session.h"

namespace tagwrench {

struct PageCore {
  std::unique_ptr<Session> session;
  std::string text;  ///< the last one handed out
  std::vector<std::uint8_t> pixels;
  std::map<std::string, tagwrench::Session::Bytes> measured;  ///< for the next sensor
};

}  // namespace tagwrench

using tagwrench::PageCore;

extern "C" {

PageCore* tagwrench_create() { return new (std::nothrow) PageCore; }

/// One of the files of measured/, for the sensor that is opened next.
void tagwrench_measured(PageCore* core, const char* name, const std::uint8_t* bytes,
                        std::size_t size) {
  core->measured[name].assign(bytes, bytes + size);
}

/// 1: open. 0: not, and tagwrench_text() says why; what was open before stays open. `calibration`
/// and `appearance` may be null.
int tagwrench_open(PageCore* core, const char* yaml, const char* name, const char* calibration,
                   const std::uint8_t* appearance, std::size_t appearance_size) {
  try {
    tagwrench::Session::Files files;
    if (calibration != nullptr) files.calibration = calibration;
    if (appearance != nullptr) files.appearance = {appearance, appearance_size};
    files.measured = std::exchange(core->measured, {});
    auto session =
        std::make_unique<tagwrench::Session>(tagwrench::Session::read(yaml, name, files), name);
    core->text = session->description();
    core->session = std::move(session);
    return 1;
  } catch (const std::exception& e) {
    core->text = e.what();
  }
  return 0;
}

/// What the last call that has a text to say said.
const char* tagwrench_text(PageCore* core) { return core->text.c_str(); }

/// Where the page puts the next frame: height rows of `stride` bytes. Null: out of memory.
std::uint8_t* tagwrench_frame(PageCore* core, int height, int stride) {
  if (height <= 0 || stride <= 0) return nullptr;
  try {
    core->pixels.resize(static_cast<std::size_t>(height) * static_cast<std::size_t>(stride));
    return core->pixels.data();
  } catch (const std::exception&) {
    return nullptr;
  }
}

/// Of the frame that lies at tagwrench_frame(). Null while nothing is open, or where the frame is
/// larger than what lies there.
const tagwrench::PageSample* tagwrench_track(PageCore* core, int width, int height, int stride,
                                             std::int64_t t_ns, double sequence) {
  const auto rows = static_cast<std::size_t>(std::max(0, height));
  if (!core->session || width <= 0 || stride < width ||
      rows * static_cast<std::size_t>(stride) > core->pixels.size())
    return nullptr;
  tagwrench::Frame frame;
  frame.image = {core->pixels.data(), width, height, stride};
  frame.capture_time = frame.latency_origin = tagwrench::TimePoint(std::chrono::nanoseconds(t_ns));
  frame.sequence = static_cast<std::uint64_t>(sequence);
  return &core->session->track(frame);
}

void tagwrench_zero(PageCore* core) {
  if (core->session) core->session->ask_zero();
}

const char* tagwrench_diagnostic(PageCore* core) {
  return core->session ? core->session->diagnostic().c_str() : "";
}

const char* tagwrench_learned(PageCore* core, const char* date) {
  if (!core->session) return "null";
  core->text = core->session->learned(date);
  return core->text.c_str();
}
}
