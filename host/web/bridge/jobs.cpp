#include "host/web/bridge/jobs.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <boost/asio/buffer.hpp>
#include <cerrno>
#include <cstring>
#include <exception>
#include <utility>

#include "host/core/config_error.h"
#include "host/core/os/child_process.h"
#include "host/core/os/termination.h"
#include "host/core/os/unique_fd.h"

// Not fuzzed: fuzz.desk_words has the lines of jobs.

namespace tagwrench {
namespace {

constexpr int kAboveOthers = 10;       // no descriptor of the child's own
constexpr int kRoom = 1 << 20;         // of the pipe for events: a picture is large
constexpr int kUnknownEnd = 255 << 8;  // where the kernel does not keep it: SIGCHLD is ignored
constexpr std::size_t kMaxSaid = 8192;
constexpr std::size_t kMaxEvent = std::size_t{8} << 20;

struct Pipe {
  UniqueFd read;
  UniqueFd write;
};

Pipe make_pipe() {
  int ends[2];
  if (::pipe2(ends, O_CLOEXEC) != 0)
    throw ConfigError("job: no pipe to be had: {}; end other programs", std::strerror(errno));
  const UniqueFd read(ends[0]);
  const UniqueFd write(ends[1]);
  return {UniqueFd(::fcntl(read.get(), F_DUPFD_CLOEXEC, kAboveOthers)),
          UniqueFd(::fcntl(write.get(), F_DUPFD_CLOEXEC, kAboveOthers))};
}

/// Of the child, between fork and exec: nothing but system calls, as other threads run and may hold
/// any lock. (_Fork(): no handlers of libraries either.)
struct Child {
  std::array<int, 4> fds;  ///< that become 0 to 3
  std::vector<int> kept;
  std::string program;
  std::vector<std::string> words;
  std::vector<char*> argv;
  Pipe* go;  ///< a byte comes once its end is watched: where SIGCHLD is ignored, one that has ended
             ///< is nobody
  pid_t parent = ::getpid();

  [[noreturn]] void become() {
    forget_termination();  // before it can come
    sigset_t none;
    sigemptyset(&none);
    ::pthread_sigmask(SIG_SETMASK, &none, nullptr);
    ::signal(SIGPIPE, SIG_DFL);
    ::prctl(PR_SET_PDEATHSIG, SIGKILL);
    if (::getppid() != parent) ::_exit(127);
    ::close(go->write.get());
    char told;
    if (::read(go->read.get(), &told, 1) != 1) ::_exit(127);
    for (std::size_t i = 0; i < fds.size(); ++i)
      if (::dup2(fds[i], static_cast<int>(i)) < 0) ::_exit(127);
    close_all_but(kept);
    ::execv(program.c_str(), argv.data());
    ::_exit(127);
  }
};

constexpr std::chrono::milliseconds kTellEvery{100};
constexpr int kFindings = 1;  // exit status of a verb that found something amiss

/// It says what it found, good or bad: that is no failure of its own.
bool finds(const std::string& verb) { return verb == "check" || verb == "doctor"; }

nlohmann::json result_of(const std::string& verb) {
  if (verb != "certificate") return nullptr;
  return {{"html", "/files/certificate.html"},
          {"pdf", "/files/certificate.pdf"},
          {"json", "/files/certificate.json"}};
}

}  // namespace

JobProcess::JobProcess(boost::asio::io_context& context, Listener listener)
    : listener_(std::move(listener)),
      out_(context),
      err_(context),
      events_(context),
      keys_(context),
      end_(context),
      patience_(context) {
  out_.by_lines = false;
  out_.whole = listener_.printed;
  err_.whole = listener_.said;
  err_.longest = kMaxSaid;
  events_.whole = listener_.event;
  events_.longest = kMaxEvent;
}

JobProcess::~JobProcess() { abandon(); }

std::shared_ptr<JobProcess> JobProcess::start(boost::asio::io_context& context,
                                              const std::string& program, const JobCommand& command,
                                              Listener listener) {
  const std::shared_ptr<JobProcess> job(new JobProcess(context, std::move(listener)));
  job->spawn(program, command);
  for (Channel* channel : {&job->out_, &job->err_, &job->events_}) {
    channel->stream.non_blocking(true);
    job->read(*channel);
  }
  job->wait_for_end();
  return job;
}

void JobProcess::spawn(const std::string& program, const JobCommand& command) {
  Pipe in = make_pipe(), out = make_pipe(), err = make_pipe(), events = make_pipe();
  Pipe go = make_pipe();
  ::fcntl(events.write.get(), F_SETPIPE_SZ, kRoom);
  Child child{{in.read.get(), out.write.get(), err.write.get(), events.write.get()},
              {0, 1, 2, kEventsFd},
              program,
              {"tagwrench"},
              {},
              &go};
  child.words.insert(child.words.end(), command.arguments.begin(), command.arguments.end());
  if (command.tells_events) child.words.push_back(fmt::format("--events={}", kEventsFd));
  for (std::string& word : child.words) child.argv.push_back(word.data());
  child.argv.push_back(nullptr);
  pid_ = ::_Fork();
  if (pid_ == 0) child.become();
  if (pid_ < 0) {
    throw ConfigError("job: {} cannot be started: {}; end other programs", program,
                      std::strerror(errno));
  }
  UniqueFd end(static_cast<int>(::syscall(SYS_pidfd_open, pid_, 0)));
  if (!end) {
    throw ConfigError("job: its end cannot be watched: {}; end other programs",
                      std::strerror(errno));
  }
  if (::write(go.write.get(), "g", 1) != 1)
    throw ConfigError("job: {} did not start: {}; try again", program, std::strerror(errno));
  for (auto [stream, fd] : {std::pair{&out_.stream, &out.read},
                            {&err_.stream, &err.read},
                            {&events_.stream, &events.read},
                            {&end_, &end}})
    stream->assign(::fcntl(fd->get(), F_DUPFD_CLOEXEC, kAboveOthers));
  if (command.takes_keys) {
    ::fcntl(in.write.get(), F_SETFL, O_NONBLOCK);
    keys_.assign(::fcntl(in.write.get(), F_DUPFD_CLOEXEC, kAboveOthers));
  }
}

void JobProcess::read(Channel& channel) {
  channel.stream.async_read_some(
      boost::asio::buffer(channel.buffer),
      [self = shared_from_this(), &channel](boost::system::error_code error, std::size_t count) {
        if (error || self->pid_ <= 0) return;
        self->take(channel, count);
        self->read(channel);
      });
}

void JobProcess::take(Channel& channel, std::size_t count) {
  std::string_view bytes(channel.buffer.data(), count);
  if (!channel.by_lines) {
    channel.whole(bytes);
    return;
  }
  while (!bytes.empty()) {
    const std::size_t end = bytes.find('\n');
    const std::string_view part = bytes.substr(0, end);
    channel.skipping = channel.skipping || channel.line.size() + part.size() > channel.longest;
    if (!channel.skipping) channel.line += part;
    if (end == std::string_view::npos) return;
    if (!channel.skipping) channel.whole(channel.line);
    channel.line.clear();
    channel.skipping = false;
    bytes.remove_prefix(end + 1);
  }
}

/// What the child wrote before it ended.
void JobProcess::drain(Channel& channel) {
  for (ssize_t count; (count = ::read(channel.stream.native_handle(), channel.buffer.data(),
                                      channel.buffer.size())) > 0;)
    take(channel, static_cast<std::size_t>(count));
  if (!channel.line.empty() && channel.by_lines) channel.whole(std::exchange(channel.line, {}));
}

void JobProcess::wait_for_end() {
  end_.async_wait(Stream::wait_read, [self = shared_from_this()](boost::system::error_code error) {
    if (!error) self->reap();
  });
}

void JobProcess::reap() {
  if (pid_ <= 0) return;  // abandoned meanwhile
  int status = kUnknownEnd;
  if (::waitpid(pid_, &status, WNOHANG) == 0) return wait_for_end();
  for (Channel* channel : {&err_, &events_, &out_}) drain(*channel);
  pid_ = 0;
  close();
  listener_.ended(status);
}

void JobProcess::press(char key) {
  if (pid_ <= 0 || !keys_.is_open()) return;
  // Who does not read his keys does not get more of them.
  [[maybe_unused]] const ssize_t written = ::write(keys_.native_handle(), &key, 1);
}

void JobProcess::abandon() {
  if (pid_ <= 0) return;
  ::kill(pid_, SIGKILL);
  ::waitpid(std::exchange(pid_, 0), nullptr, 0);
  close();
}

void JobProcess::close() {
  boost::system::error_code ignored;
  for (Stream* stream : {&out_.stream, &err_.stream, &events_.stream, &keys_, &end_})
    stream->close(ignored);
  patience_.cancel();
}

void JobProcess::stop() {
  if (pid_ <= 0 || std::exchange(stopping_, true)) return;
  ::kill(pid_, SIGTERM);
  patience_.expires_after(kPatience);
  patience_.async_wait([self = shared_from_this()](boost::system::error_code error) {
    if (!error && self->pid_ > 0) ::kill(self->pid_, SIGKILL);
  });
}

Jobs::Jobs(boost::asio::io_context& context, std::string program, Hooks hooks)
    : context_(context),
      program_(std::move(program)),
      hooks_(std::move(hooks)),
      telling_(context) {}

void Jobs::start(JobCommand command, bool camera_is_free) {
  if (running())
    throw RequestRefused(fmt::format("{} runs already; stop it first", report_->verb()));
  command_ = std::move(command);
  std::vector<std::string> keys{"stop"};
  if (command_.takes_keys) keys = {"skip", "redo", "stop"};
  report_.emplace(command_.verb, std::move(keys));
  if (!command_.needs_camera || camera_is_free)
    spawn();
  else
    hooks_.want_camera();
  hooks_.changed();
  log_soon();
}

void Jobs::spawn() {
  const auto on_line = [this](auto take) {
    return [this, take](std::string_view text) {
      ((*report_).*take)(text);
      log_soon();
    };
  };
  JobProcess::Listener listener;
  listener.printed = on_line(&JobReport::printed);
  listener.said = on_line(&JobReport::said);
  listener.event = [this](std::string_view line) {
    if (const std::optional<JobPicture> picture = report_->event(line))
      hooks_.show(*picture);
    else
      log_soon();
  };
  listener.ended = [this](int status) { ended(status); };
  try {
    process_ = JobProcess::start(context_, program_, command_, std::move(listener));
  } catch (const std::exception& e) {
    finish(JobReport::State::failed, e.what());
  }
}

void Jobs::ended(int status) {
  const bool stopped = process_->stopping();
  process_.reset();
  using State = JobReport::State;
  const bool well =
      WIFEXITED(status) &&
      (WEXITSTATUS(status) == 0 || (WEXITSTATUS(status) == kFindings && finds(command_.verb)));
  if (well) return finish(State::done, {}, result_of(command_.verb));
  if (stopped) return finish(State::stopped, {});
  if (WIFSIGNALED(status)) {
    return finish(State::failed, fmt::format("{} was ended from outside ({}); start it again",
                                             command_.verb, ::strsignal(WTERMSIG(status))));
  }
  finish(State::failed, {});
}

void Jobs::finish(JobReport::State state, std::string why, nlohmann::json result) {
  report_->ended(state, std::move(why), std::move(result));
  if (command_.needs_camera) hooks_.give_back_camera();
  hooks_.changed();
  log_soon();
}

void Jobs::press(const std::string& key) {
  if (!running()) throw RequestRefused("key: no job runs that could take it");
  if (key == "stop") {
    if (process_) return process_->stop();
    report_->ended(JobReport::State::stopped, {}, nullptr);  // it has not begun
    hooks_.changed();
    return log_soon();
  }
  const bool known = key == "skip" || key == "redo";
  if (!known || !command_.takes_keys || !process_)
    throw RequestRefused(fmt::format("key: {} takes {}", report_->verb(),
                                     command_.takes_keys ? "skip, redo and stop" : "stop alone"));
  process_->press(key == "skip" ? 's' : 'r');
}

void Jobs::close() {
  if (running()) throw RequestRefused(fmt::format("{} runs; stop it first", report_->verb()));
  report_.reset();
  hooks_.changed();
}

void Jobs::log_soon() {
  if (std::exchange(will_tell_, true)) return;
  telling_.after(kTellEvery, [this] {
    will_tell_ = false;
    if (report_) hooks_.tell(report_->to_json());
  });
}

}  // namespace tagwrench
