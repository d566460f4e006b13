#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <filesystem>

#include "host/core/config_error.h"
#include "host/web/server/web_options.h"
#include "host/web/server/web_server.h"
#include "tests/support/temporary_folder.h"

namespace tagwrench {
namespace {

using std::filesystem::perms;
using test::TemporaryFolder;

std::string token_fault(const std::filesystem::path& file) {
  try {
    web_token(file);
  } catch (const ConfigError& error) {
    return error.what();
  }
  return "no fault";
}

TEST(WebToken, IsMadeOnceForItsOwnerAlone) {
  TemporaryFolder folder;
  const std::string made = web_token(folder / "token");
  EXPECT_EQ(made.size(), 43U);
  EXPECT_EQ(std::filesystem::status(folder / "token").permissions(),
            perms::owner_read | perms::owner_write);
  EXPECT_EQ(web_token(folder / "token"), made);
  EXPECT_NE(web_token(folder / "other"), made);
}

TEST(WebToken, MayBeWrittenByHand) {
  TemporaryFolder folder;
  folder.write("token", "a-token.of_mine~16\r\n");
  std::filesystem::permissions(folder / "token", perms::owner_read);
  EXPECT_EQ(web_token(folder / "token"), "a-token.of_mine~16");
}

TEST(WebToken, ThatOthersMayReadIsRefused) {
  TemporaryFolder folder;
  folder.write("token", "0123456789abcdef");
  std::filesystem::permissions(folder / "token", perms::owner_all | perms::group_read);
  EXPECT_NE(token_fault(folder / "token").find("chmod 600"), std::string::npos);
}

TEST(WebToken, OfAnotherUserIsRefused) {
  if (::geteuid() != 0) GTEST_SKIP() << "only root can give a file to another user";
  TemporaryFolder folder;
  folder.write("token", "0123456789abcdef");
  std::filesystem::permissions(folder / "token", perms::owner_read);
  ASSERT_EQ(::chown((folder / "token").c_str(), 12345, 12345), 0);
  EXPECT_NE(token_fault(folder / "token").find("another user's"), std::string::npos);
}

TEST(WebToken, ThatIsNoneIsRefused) {
  TemporaryFolder folder;
  for (const std::string text : {"", "short", "0123456789abcde", "0123456789abcdef 1",
                                 "0123456789abcdef/", "0123456789abcdef\nmore"}) {
    folder.write("token", text);
    std::filesystem::permissions(folder / "token", perms::owner_read | perms::owner_write);
    EXPECT_NE(token_fault(folder / "token").find("16 to 128"), std::string::npos) << text;
  }
  EXPECT_NE(token_fault(folder / "missing/token").find("cannot be written"), std::string::npos);
  EXPECT_NE(token_fault(folder.path()).find("is not a file"), std::string::npos);
}

std::string server_fault(const WebOptions& options) {
  try {
    const WebServer server(options);
  } catch (const ConfigError& error) {
    return error.what();
  }
  return "no fault";
}

TEST(WebServerSetup, AnAddressThatOthersReachNeedsAToken) {
  for (const char* address : {"0.0.0.0", "::", "192.0.2.1"}) {
    WebOptions options;
    options.address = address;
    options.port = 0;
    EXPECT_NE(server_fault(options).find("--web-token"), std::string::npos) << address;
  }
  WebOptions options;
  options.address = "0.0.0.0";
  options.port = 0;
  options.token = "0123456789abcdef";
  EXPECT_EQ(server_fault(options), "no fault");
}

TEST(WebServerSetup, LoopbackNeedsNoToken) {
  for (const char* address : {"localhost", "127.0.0.1", "127.0.0.2", "::1", "[::1]"}) {
    WebOptions options;
    options.address = address;
    options.port = 0;
    const std::string fault = server_fault(options);
    EXPECT_EQ(fault.find("--web-token"), std::string::npos) << fault;
    EXPECT_EQ(fault.find("not an address"), std::string::npos) << fault;
  }
}

TEST(WebServerSetup, APortThatIsTakenIsSaid) {
  WebOptions options;
  options.port = 0;
  const WebServer first(options);
  options.port = first.port();
  const std::string fault = server_fault(options);
  EXPECT_NE(fault.find("127.0.0.1:" + std::to_string(first.port()) + " is taken"),
            std::string::npos)
      << fault;
}

TEST(WebServerSetup, WhatIsNoAddressOfThisComputerIsSaid) {
  WebOptions options;
  options.port = 0;
  options.address = "lab.example";
  EXPECT_NE(server_fault(options).find("not an address"), std::string::npos);
  options.address = "192.0.2.1";
  options.token = "0123456789abcdef";
  EXPECT_NE(server_fault(options).find("cannot listen"), std::string::npos);
}

TEST(WebServerSetup, TheTokenIsInNoAddress) {
  WebOptions options;
  options.port = 0;
  options.token = "0123456789abcdef";
  const WebServer server(options);
  const std::string url = "http://127.0.0.1:" + std::to_string(server.port()) + '/';
  EXPECT_EQ(server.url(), url);
  EXPECT_EQ(server.local_url(), url) << "what every user may read in the list of processes";
}

TEST(WebServerSetup, AtAnyAddressTheOwnBrowserIsSentToLocalhost) {
  WebOptions options;
  options.port = 0;
  options.address = "0.0.0.0";
  options.token = "0123456789abcdef";
  const WebServer server(options);
  EXPECT_EQ(server.local_url(), "http://localhost:" + std::to_string(server.port()) + '/');
}

}  // namespace
}  // namespace tagwrench
