// The bridge asks the desk without waiting for it.
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <boost/asio/io_context.hpp>
#include <cerrno>
#include <cstddef>
#include <filesystem>
#include <optional>

#include "host/core/os/unique_fd.h"
#include "host/motion/control_socket.h"
#include "host/web/bridge/control_link.h"
#include "tests/support/temporary_folder.h"

namespace tagwrench {
namespace {

TEST(ControlLinks, GetOneAnswerARequestInOrder) {
  const std::string path =
      (std::filesystem::temp_directory_path() / ("desk-" + std::to_string(::getpid()))).string();
  boost::asio::io_context context;
  ControlLink link(context, path);
  std::vector<ControlAnswer> answers;
  const auto take = [&](ControlAnswer answer) { answers.push_back(std::move(answer)); };
  link.ask("zero", take);
  context.run();
  ASSERT_EQ(answers.size(), 1U);
  EXPECT_FALSE(answers[0].ok);
  EXPECT_NE(answers[0].text.find("does not run"), std::string::npos);

  ControlSocket profiles(path);
  link.ask("next", take);
  link.ask("show cad", take);
  context.restart();
  while (answers.size() < 3) {
    context.poll();
    context.restart();
    const ControlRequest request = profiles.next();
    if (request.kind == ControlRequest::Kind::next_profile) profiles.answer("ok: game\n");
    if (request.kind == ControlRequest::Kind::show) profiles.answer("error: no profile 'cad'\n");
  }
  EXPECT_TRUE(answers[1].ok);
  EXPECT_EQ(answers[1].text, "game");
  EXPECT_FALSE(answers[2].ok);
  EXPECT_EQ(answers[2].text, "no profile 'cad'");
}

/// The kernel's answer to who writes to the address of another; 0: it was taken.
int write_to(std::string_view address, std::string_view text) {
  const UniqueFd forger(::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0));
  sockaddr_un to{};
  to.sun_family = AF_UNIX;
  address.copy(to.sun_path, sizeof to.sun_path);
  const auto size = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + address.size());
  const ssize_t sent = ::sendto(forger.get(), text.data(), text.size(), 0,
                                reinterpret_cast<const sockaddr*>(&to), size);
  return sent < 0 ? errno : 0;
}

TEST(ControlLinks, HearTheDeskAndNobodyElse) {
  const test::TemporaryFolder folder;
  const std::string path = folder / "desk";
  ControlSocket profiles(path);
  boost::asio::io_context context;
  ControlLink link(context, path);
  std::optional<ControlAnswer> answer;
  link.ask("show cad", [&](ControlAnswer given) { answer = std::move(given); });
  ASSERT_EQ(profiles.next().kind, ControlRequest::Kind::show);
  ASSERT_FALSE(profiles.asker().empty());
  EXPECT_EQ(write_to(profiles.asker(), "ok: /etc/passwd\nname: cad\n"), EPERM);
  profiles.answer("ok: mine.yaml\n");
  while (!answer) context.run_one();
  EXPECT_EQ(answer->text, "mine.yaml");
}

TEST(ControlLinks, FindTheDeskAgainAfterARestart) {
  const test::TemporaryFolder folder;
  const std::string path = folder / "desk";
  boost::asio::io_context context;
  ControlLink link(context, path);
  for (int run = 0; run < 2; ++run) {
    ControlSocket profiles(path);
    std::optional<ControlAnswer> answer;
    link.ask("next", [&](ControlAnswer given) { answer = std::move(given); });
    ASSERT_EQ(profiles.next().kind, ControlRequest::Kind::next_profile) << "run " << run;
    profiles.answer("ok: game\n");
    while (!answer) context.run_one();
    EXPECT_EQ(answer->text, "game");
  }
}

TEST(ControlLinks, RefuseWhatWouldWaitBehindAHundredOthers) {
  const test::TemporaryFolder folder;
  ControlSocket deaf(folder / "desk");
  boost::asio::io_context context;
  ControlLink link(context, folder / "desk");
  int refused = 0;
  for (int i = 0; i < 100; ++i)
    link.ask("zero", [&](const ControlAnswer& answer) {
      if (answer.text.starts_with("too many")) ++refused;
    });
  context.poll();
  EXPECT_EQ(refused, 100 - static_cast<int>(ControlLink::kMostWaiting));
}

TEST(ControlLinks, ThatAreGoneAnswerNobody) {
  boost::asio::io_context context;
  bool answered = false;
  {
    ControlLink link(context, "/nonexistent/desk");
    link.ask("zero", [&](const ControlAnswer&) { answered = true; });
  }
  context.run();
  EXPECT_FALSE(answered);
}

}  // namespace
}  // namespace tagwrench
