#include "host/motion/trial_reader.h"

#include <pthread.h>
#include <sys/eventfd.h>
#include <sys/resource.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstdint>
#include <cstring>
#include <system_error>
#include <utility>

#include "host/core/config_error.h"
#include "host/core/os/remedy.h"
#include "host/motion/control_socket.h"

namespace tagwrench {
namespace {

constexpr int kNice = 5;  // frames go before texts

TrialReader::Reading reading_of(TrialReader::Text given) {
  TrialReader::Reading reading{std::move(given.asker), given.profile, {}, {}};
  try {
    Profile profile =
        parse_profile(given.text, given.file.empty() ? given.name : given.file, given.defaults);
    profile.name = given.name;
    reading.answer = "ok: " + given.file + "\n" + profile_text(profile);
    if (reading.answer.size() > ControlSocket::kMaxAnswer)
      reading.answer = "error: too long to be tried\n";
    else
      reading.read = std::move(profile);
  } catch (const std::exception& e) {
    reading.answer = "error: " + std::string(e.what()) + "\n";
  }
  return reading;
}

}  // namespace

TrialReader::TrialReader() : done_(::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)) {
  if (!done_)
    throw ConfigError("profiles: no event to be had: {}; {}", std::strerror(errno),
                      remedy_for(errno, "end other programs"));
  sigset_t all;
  sigset_t before;
  sigfillset(&all);
  pthread_sigmask(SIG_SETMASK, &all, &before);
  try {
    thread_ = std::thread([this] { run(); });
  } catch (const std::system_error& e) {
    pthread_sigmask(SIG_SETMASK, &before, nullptr);
    throw ConfigError(std::string("profiles: no thread to be had: ") + e.what() +
                      "; end other programs");
  }
  pthread_sigmask(SIG_SETMASK, &before, nullptr);
}

TrialReader::~TrialReader() {
  {
    const std::lock_guard lock(mutex_);
    ending_ = true;
  }
  wake_.notify_one();
  thread_.join();
}

bool TrialReader::read(Text text) {
  {
    const std::lock_guard lock(mutex_);
    if (std::exchange(busy_, true)) return false;
    text_ = std::move(text);
  }
  wake_.notify_one();
  return true;
}

std::optional<TrialReader::Reading> TrialReader::take() noexcept {
  std::uint64_t times = 0;
  if (::read(done_.get(), &times, sizeof times) < 0) return {};
  const std::lock_guard lock(mutex_);
  busy_ = false;
  return std::exchange(reading_, {});
}

void TrialReader::run() noexcept {
  pthread_setname_np(pthread_self(), "tagwrench-trial");
  ::setpriority(PRIO_PROCESS, static_cast<id_t>(::gettid()), kNice);
  std::unique_lock lock(mutex_);
  while (true) {
    wake_.wait(lock, [this] { return ending_ || text_; });
    if (ending_) return;
    Text text = *std::exchange(text_, {});
    lock.unlock();
    Reading reading = reading_of(std::move(text));
    lock.lock();
    reading_ = std::move(reading);
    const std::uint64_t once = 1;
    [[maybe_unused]] const ssize_t told = ::write(done_.get(), &once, sizeof once);
    if (wake_.wait_for(lock, kInterval, [this] { return ending_; })) return;
  }
}

}  // namespace tagwrench
