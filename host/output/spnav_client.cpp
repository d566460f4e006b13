#include "host/output/spnav_client.h"

#include <sys/epoll.h>
#include <sys/socket.h>

#include <algorithm>
#include <bit>
#include <cerrno>
#include <chrono>
#include <limits>
#include <utility>

namespace tagwrench {
namespace {

/// The kernel counts about 770 bytes a record, and doubles this.
constexpr int kSendBuffer_bytes = 8192;
constexpr int kRequestsAtOnce = 16;
/// libspnav speaks right after it has connected, and waits as long for the answer.
constexpr Duration kTimeToSpeak = std::chrono::milliseconds(300);

std::int32_t milliseconds_since(TimePoint then, TimePoint now) {
  const auto elapsed = std::chrono::duration_cast<std::chrono::milliseconds>(now - then).count();
  return static_cast<std::int32_t>(
      std::clamp<std::int64_t>(elapsed, 0, std::numeric_limits<std::int32_t>::max()));
}

}  // namespace

SpnavClient::SpnavClient(UniqueFd socket, const SpnavPeer& peer, bool device_present) noexcept
    : socket_(std::move(socket)),
      peer_(peer),
      device_told_(device_present),
      told_at_(std::chrono::steady_clock::now()),
      silent_until_(told_at_ + kTimeToSpeak) {
  ::setsockopt(socket_.get(), SOL_SOCKET, SO_SNDBUF, &kSendBuffer_bytes, sizeof kSendBuffer_bytes);
}

void SpnavClient::read(const SpnavDevice* device, std::string_view path) noexcept {
  for (int i = 0; i < kRequestsAtOnce && rest_size_ == 0 && !gone_; ++i) {
    std::array<std::uint8_t, sizeof(SpnavRecord)> bytes;
    const ssize_t got = ::recv(socket_.get(), bytes.data(), dialogue_.wanted(), MSG_DONTWAIT);
    if (got < 0 && (errno == EAGAIN || errno == EINTR)) return;
    if (got <= 0) {
      gone_ = true;
      return;
    }
    answer(dialogue_.take(std::span(bytes).first(static_cast<std::size_t>(got)), device, path));
  }
}

void SpnavClient::answer(std::span<const std::uint8_t> bytes) noexcept {
  if (dialogue_.has_spoken()) silent_until_ = TimePoint::min();
  rest_size_ = bytes.size();
  std::copy(bytes.begin(), bytes.end(), rest_.begin());
  flush();
}

/// True when nothing is under way.
bool SpnavClient::flush() noexcept {
  while (rest_size_ > 0 && !gone_) {
    const ssize_t sent =
        ::send(socket_.get(), rest_.data(), rest_size_, MSG_DONTWAIT | MSG_NOSIGNAL);
    if (sent < 0 && errno == EINTR) continue;
    if (sent < 0 && errno == EAGAIN) return false;
    if (sent < 0) {
      gone_ = true;
      return false;
    }
    rest_size_ -= static_cast<std::size_t>(sent);
    std::copy_n(rest_.begin() + sent, rest_size_, rest_.begin());
  }
  return !gone_;
}

/// All of it, or nothing: what the kernel took in part goes on its way later.
bool SpnavClient::put(const SpnavRecord& record) noexcept {
  if (rest_size_ > 0 || gone_) return false;
  const ssize_t sent =
      ::send(socket_.get(), record.data(), sizeof record, MSG_DONTWAIT | MSG_NOSIGNAL);
  if (sent < 0) {
    gone_ = errno != EAGAIN && errno != EINTR;
    return false;
  }
  const auto bytes = std::bit_cast<std::array<std::uint8_t, sizeof record>>(record);
  rest_size_ = sizeof record - static_cast<std::size_t>(sent);
  std::copy(bytes.begin() + sent, bytes.end(), rest_.begin());
  return true;
}

void SpnavClient::show(const SpnavState& state, const SpnavDevice* device, bool moved,
                       TimePoint now) noexcept {
  if (behind_ || gone_ || now < silent_until_) return;
  const bool leaving = device == nullptr;
  const bool told = (leaving || show_device(device)) && show_buttons(state.buttons) &&
                    show_motion(state.motion, moved, now) && (!leaving || show_device(device));
  behind_ = !told;
}

void SpnavClient::resume(const SpnavState& state, const SpnavDevice* device,
                         TimePoint now) noexcept {
  if (!flush() || !behind_) return;
  behind_ = false;
  show(state, device, true, now);
}

bool SpnavClient::show_device(const SpnavDevice* device) noexcept {
  const bool present = device != nullptr;
  if (present == device_told_) {
    if (present) told_device_ = *device;
    return true;
  }
  const SpnavDevice& about = present ? *device : told_device_;
  if (dialogue_.wants(SpnavDialogue::kDevice) && !put(spnav_device(present, about))) return false;
  device_told_ = present;
  told_device_ = about;
  return true;
}

bool SpnavClient::show_buttons(std::uint32_t buttons) noexcept {
  for (int i = 0; i < kSpnavButtons; ++i) {
    const std::uint32_t bit = std::uint32_t{1} << i;
    if (((buttons ^ told_.buttons) & bit) == 0) continue;
    const bool pressed = (buttons & bit) != 0;
    if (dialogue_.wants(SpnavDialogue::kButton) && !put(spnav_button(i, pressed))) return false;
    told_.buttons ^= bit;
  }
  return true;
}

bool SpnavClient::show_motion(const Counts6& motion, bool moved, TimePoint now) noexcept {
  const bool off_centre = motion != Counts6{};
  const bool event = off_centre ? moved || motion != told_.motion : told_.off_centre();
  if (!event || !dialogue_.wants(SpnavDialogue::kMotion)) return true;
  if (!put(spnav_motion(motion, dialogue_.sensitivity(), milliseconds_since(told_at_, now))))
    return false;
  told_.motion = motion;
  told_at_ = now;
  return true;
}

std::uint32_t SpnavClient::interest() const noexcept {
  return behind_ || rest_size_ > 0 ? std::uint32_t{EPOLLOUT} : std::uint32_t{EPOLLIN};
}

}  // namespace tagwrench
