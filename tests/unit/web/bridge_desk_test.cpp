// The bridge asks the desk without waiting for it.
#include <gtest/gtest.h>
#include <unistd.h>

#include <boost/asio/io_context.hpp>
#include <filesystem>

#include "host/motion/control_socket.h"
#include "host/web/bridge/control_link.h"

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
