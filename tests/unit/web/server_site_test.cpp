#include <gtest/gtest.h>

#include "host/web/server/static_site.h"
#include "tests/support/temporary_folder.h"

namespace tagwrench {
namespace {

using test::TemporaryFolder;

class WebSite : public testing::Test {
 protected:
  WebSite() {
    folder_.write("dashboard/index.html", "dashboard");
    folder_.write("dashboard/assets/index-1a2b.js", "js");
    folder_.write("sensor/index.html", "tab");
    folder_.write("sensor/assets/worker-1a2b.js", "worker");
    folder_.write("sensor/assets/core-1a2b.wasm", "wasm");
    folder_.write("secret.txt", "secret");
  }

  WebAnswer get(std::string_view target, std::string_view method = "GET") {
    WebRequest request{};
    request.our_user = true;
    request.method = method;
    request.target = target;
    request.host = "localhost:8137";
    request.if_none_match = if_none_match_;
    return site_.answer(request);
  }
  static bool has(const WebAnswer& answer, std::string_view line) {
    return answer.fields.find(std::string(line) + "\r\n") != std::string::npos;
  }
  static std::string field(const WebAnswer& answer, const std::string& name) {
    const std::size_t at = answer.fields.find(name + ": ") + name.size() + 2;
    return answer.fields.substr(at, answer.fields.find("\r\n", at) - at);
  }

  TemporaryFolder folder_;
  StaticSite site_{folder_.path(), ""};
  std::string if_none_match_;
};

TEST_F(WebSite, PagesAreFoundByTheirFolders) {
  EXPECT_EQ(get("/").file.size, 9U);
  EXPECT_EQ(get("/sensor/").file.size, 3U);
  EXPECT_EQ(get("/assets/index-1a2b.js").status, 200U);
  EXPECT_EQ(get("/sensor/assets/core-1a2b.wasm").status, 200U);
  EXPECT_EQ(get("/sensor").status, 308U);
  EXPECT_TRUE(has(get("/sensor"), "Location: /sensor/"));
}

TEST_F(WebSite, WhatIsNotInAPagesFolderIsNotThere) {
  EXPECT_EQ(get("/secret.txt").status, 404U);
  EXPECT_EQ(get("/dashboard/index.html").status, 404U);
  EXPECT_EQ(get("/assets").status, 404U);
  EXPECT_EQ(get("/files/secret.txt").status, 404U);
  EXPECT_EQ(get("/../secret.txt").status, 400U);
  EXPECT_EQ(get("/sensor/%2e%2e/secret.txt").status, 400U);
}

TEST_F(WebSite, ARefusalTellsNothing) {
  for (const char* target : {"/../secret.txt", "/secret.txt", "/files/x", "/files/../secret.txt"}) {
    const WebAnswer answer = get(target);
    EXPECT_EQ(answer.text.find("secret"), std::string::npos) << target;
    EXPECT_EQ(answer.text.find(folder_.path()), std::string::npos) << target;
    EXPECT_TRUE(has(answer, "Content-Type: text/plain; charset=utf-8")) << target;
  }
}

TEST_F(WebSite, TypesAreSaidAndNotGuessed) {
  EXPECT_TRUE(has(get("/"), "Content-Type: text/html; charset=utf-8"));
  EXPECT_TRUE(has(get("/assets/index-1a2b.js"), "Content-Type: text/javascript; charset=utf-8"));
  EXPECT_TRUE(has(get("/sensor/assets/core-1a2b.wasm"), "Content-Type: application/wasm"));
  for (const char* target : {"/", "/assets/index-1a2b.js", "/missing", "/../x", "/sensor"})
    EXPECT_TRUE(has(get(target), "X-Content-Type-Options: nosniff")) << target;
}

TEST_F(WebSite, NoPageRunsWhatIsNotItsOwn) {
  for (const char* target : {"/", "/sensor/"}) {
    const std::string policy = field(get(target), "Content-Security-Policy");
    EXPECT_EQ(policy.find("unsafe-inline"), std::string::npos) << policy;
    EXPECT_EQ(policy.find("'unsafe-eval'"), std::string::npos) << policy;
    EXPECT_EQ(policy.find('*'), std::string::npos) << policy;
    EXPECT_NE(policy.find("default-src 'none'"), std::string::npos);
    EXPECT_NE(policy.find("frame-ancestors 'none'"), std::string::npos);
    EXPECT_NE(policy.find("connect-src 'self' ws://localhost:8137;"), std::string::npos);
  }
  EXPECT_EQ(field(get("/"), "Content-Security-Policy").find("wasm"), std::string::npos);
  EXPECT_TRUE(
      has(get("/missing"), "Content-Security-Policy: default-src 'none'; frame-ancestors 'none'"));
}

TEST_F(WebSite, OnlyTheTabMayHaveTheCamera) {
  EXPECT_NE(field(get("/sensor/"), "Permissions-Policy").find("camera=(self)"), std::string::npos);
  EXPECT_NE(field(get("/"), "Permissions-Policy").find("camera=()"), std::string::npos);
}

TEST_F(WebSite, NamesThatChangeWithTheirContentAreKeptAndOthersAskedFor) {
  EXPECT_TRUE(
      has(get("/assets/index-1a2b.js"), "Cache-Control: public, max-age=31536000, immutable"));
  const WebAnswer page = get("/");
  EXPECT_TRUE(has(page, "Cache-Control: no-cache"));
  if_none_match_ = field(page, "ETag");
  EXPECT_EQ(get("/").status, 304U);
  EXPECT_FALSE(get("/").file.fd);
  folder_.write("dashboard/index.html", "changed dashboard");
  EXPECT_EQ(get("/").status, 200U);
}

TEST_F(WebSite, OnlyGetAndHeadAreServed) {
  EXPECT_EQ(get("/", "HEAD").status, 200U);
  for (const char* method : {"POST", "PUT", "DELETE", "OPTIONS", "CONNECT", "TRACE", "get", ""})
    EXPECT_EQ(get("/", method).status, 405U) << method;
}

TEST_F(WebSite, PagesThatAreNotBuiltSayWhatBuildsThem) {
  const WebAnswer answer = get("/flip/");
  EXPECT_EQ(answer.status, 503U);
  EXPECT_NE(answer.text.find("./run web"), std::string::npos);
  EXPECT_TRUE(has(answer, "Content-Type: text/html; charset=utf-8"));
}

TEST_F(WebSite, FoldersShowTheirFilesAndNoOthers) {
  folder_.write("recordings/push.twr", "recording");
  folder_.write("recordings/.hidden", "hidden");
  folder_.write("recordings/sub/deep.twr", "deep");
  site_.serve_folder("/files/recordings/", folder_ / "recordings");
  const WebAnswer answer = get("/files/recordings/push.twr");
  EXPECT_EQ(answer.file.size, 9U);
  EXPECT_TRUE(has(answer, "Content-Disposition: attachment"));
  EXPECT_EQ(get("/files/recordings/sub/deep.twr").status, 404U);
  EXPECT_EQ(get("/files/recordings/sub").status, 404U);
  EXPECT_EQ(get("/files/recordings/").status, 404U);
  EXPECT_EQ(get("/files/recordings/.hidden").status, 400U);
  EXPECT_EQ(get("/files/push.twr").status, 404U);
}

TEST_F(WebSite, ASingleFileIsServedWhileItIsThere) {
  site_.serve_file("/files/certificate.html", folder_ / "made/certificate.html");
  EXPECT_EQ(get("/files/certificate.html").status, 404U);
  folder_.write("made/certificate.html", "<style>p{}</style>");
  folder_.write("made/other.txt", "other");
  const WebAnswer answer = get("/files/certificate.html");
  EXPECT_EQ(answer.status, 200U);
  const std::string policy = field(answer, "Content-Security-Policy");
  EXPECT_NE(policy.find("sandbox; default-src 'none'"), std::string::npos) << policy;
  EXPECT_EQ(policy.find("script"), std::string::npos) << policy;
  EXPECT_EQ(get("/files/other.txt").status, 404U);
}

}  // namespace
}  // namespace tagwrench
