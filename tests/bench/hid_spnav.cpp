#include "tests/bench/hid_spnav.h"

#include <pthread.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <stdexcept>

namespace tagwrench::bench {

HidHolder::HidHolder(const std::string& path) {
  int ends[2];
  if (::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends) != 0)
    throw std::runtime_error("no socket pair");
  stop_.reset(ends[0]);
  stopped_.reset(ends[1]);
  std::optional<SpnavSockets> sockets = listen_spnav(path);
  if (!sockets) throw std::runtime_error("a daemon is there already: " + path);
  thread_ = std::thread([stop = stopped_.get(), own = std::move(*sockets)]() mutable {
    run_spnav_daemon(std::move(own), {}, stop);
  });
}

HidHolder::~HidHolder() {
  stop_.reset();
  thread_.join();
}

double HidHolder::cpu_seconds() const {
  clockid_t clock{};
  timespec used{};
  auto& thread = const_cast<std::thread&>(thread_);
  if (::pthread_getcpuclockid(thread.native_handle(), &clock) != 0) return 0;
  ::clock_gettime(clock, &used);
  return static_cast<double>(used.tv_sec) + 1e-9 * static_cast<double>(used.tv_nsec);
}

UniqueFd connect_as_program(const std::string& path) {
  UniqueFd fd(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0));
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  path.copy(address.sun_path, sizeof address.sun_path - 1);
  const std::uint32_t request = 0x7faa5501;
  std::uint32_t answer = 0;
  if (::connect(fd.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0 ||
      ::send(fd.get(), &request, sizeof request, MSG_NOSIGNAL) != sizeof request ||
      ::recv(fd.get(), &answer, sizeof answer, MSG_WAITALL) != sizeof answer || answer != request)
    throw std::runtime_error(path + ": " + std::strerror(errno));
  return fd;
}

SpnavListener::SpnavListener(const std::string& path) : socket_(connect_as_program(path)) {
  events_.reserve(1 << 16);
  thread_ = std::thread([this] { listen(); });
}

SpnavListener::~SpnavListener() { events(); }

const std::vector<SpnavEvent>& SpnavListener::events() {
  if (thread_.joinable()) {
    ::shutdown(socket_.get(), SHUT_RDWR);
    thread_.join();
  }
  return events_;
}

void SpnavListener::listen() {
  std::array<std::int32_t, 8> record{};
  while (::recv(socket_.get(), record.data(), sizeof record, MSG_WAITALL) == sizeof record) {
    if (record[0] != 0) continue;  // the coming of the device
    SpnavEvent event{std::chrono::steady_clock::now(), {}};
    std::copy_n(record.begin() + 1, 6, event.motion.begin());
    events_.push_back(event);
  }
}

}  // namespace tagwrench::bench
