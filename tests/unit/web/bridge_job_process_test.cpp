// A child process: what it says, its keys, and its end, whatever that is.
#include <gtest/gtest.h>
#include <sys/wait.h>

#include <csignal>
#include <optional>

#include "host/web/bridge/jobs.h"

namespace tagwrench {
namespace {

struct HeardOfChild {
  std::string printed;
  std::vector<std::string> said;
  std::vector<std::string> events;
  std::optional<int> status;
};

/// A shell stands for our own program.
std::shared_ptr<JobProcess> start_shell(boost::asio::io_context& context, const std::string& script,
                                        HeardOfChild& heard) {
  JobCommand command;
  command.arguments = {"-c", script};
  command.takes_keys = true;
  JobProcess::Listener listener;
  listener.printed = [&](std::string_view text) { heard.printed += text; };
  listener.said = [&](std::string_view line) { heard.said.emplace_back(line); };
  listener.event = [&](std::string_view line) { heard.events.emplace_back(line); };
  listener.ended = [&](int status) { heard.status = status; };
  return JobProcess::start(context, "/bin/sh", command, std::move(listener));
}

TEST(JobProcesses, AreHeardToTheirLastWord) {
  boost::asio::io_context context;
  HeardOfChild heard;
  const auto job = start_shell(
      context, "echo found; echo one >&2; echo '{\"live\":1}' >&3; printf two >&2; exit 3", heard);
  context.run();
  EXPECT_EQ(heard.printed, "found\n");
  EXPECT_EQ(heard.said, (std::vector<std::string>{"one", "two"}));
  EXPECT_EQ(heard.events, std::vector<std::string>{"{\"live\":1}"});
  ASSERT_TRUE(heard.status);
  EXPECT_EQ(WEXITSTATUS(*heard.status), 3);
}

TEST(JobProcesses, GetTheirKeysAndHaveNoOtherFilesOpen) {
  boost::asio::io_context context;
  HeardOfChild heard;
  const auto job = start_shell(context, "head -c 1; ls /proc/self/fd | wc -l >&2", heard);
  job->press('s');
  context.run();
  EXPECT_EQ(heard.printed, "s");
  EXPECT_EQ(heard.said, std::vector<std::string>{"5"});  // 0 to 3, and the folder itself
}

TEST(JobProcesses, AreToldToStopAndTheirDeathIsNoticed) {
  boost::asio::io_context context;
  HeardOfChild stopped;
  const auto job = start_shell(context, "exec tail -f /dev/null", stopped);
  job->stop();
  context.run();
  ASSERT_TRUE(stopped.status);
  EXPECT_EQ(WTERMSIG(*stopped.status), SIGTERM);
  context.restart();
  HeardOfChild killed;
  const auto other = start_shell(context, "kill -9 $$", killed);
  context.run();
  ASSERT_TRUE(killed.status);
  EXPECT_EQ(WTERMSIG(*killed.status), SIGKILL);
}

/// As in a service whose parent ignored it.
TEST(JobProcesses, EndAsFailedWhereTheKernelKeepsNoStatus) {
  boost::asio::io_context context;
  HeardOfChild heard;
  const auto before = std::signal(SIGCHLD, SIG_IGN);
  const auto job = start_shell(context, "echo found", heard);
  context.run();
  std::signal(SIGCHLD, before);
  EXPECT_EQ(heard.printed, "found\n");
  ASSERT_TRUE(heard.status);
  EXPECT_TRUE(WIFEXITED(*heard.status));
  EXPECT_EQ(WEXITSTATUS(*heard.status), 255);
}

}  // namespace
}  // namespace tagwrench
