#include <gtest/gtest.h>

#include "host/web/server/request_guard.h"

namespace tagwrench {
namespace {

constexpr const char* kGuardToken = "0123456789abcdef";
constexpr const char* kGuardTokenEntry = "tagwrench.token.MDEyMzQ1Njc4OWFiY2RlZg";

WebRequest socket_request() {
  WebRequest request{};
  request.method = "GET";
  request.target = "/ws";
  request.host = "localhost:8137";
  request.origin = "http://localhost:8137";
  request.protocols = "tagwrench.v1";
  request.upgrade = true;
  request.our_user = true;
  return request;
}

TEST(WebGuard, LoopbackNamesAtAnyPortAreThisComputer) {
  for (const char* host :
       {"localhost", "localhost:8137", "LocalHost:9", "127.0.0.1", "127.0.0.1:65535", "127.0.0.2:1",
        "127.255.255.255", "[::1]", "[::1]:8137"})
    EXPECT_TRUE(is_loopback_host(host)) << host;
}

TEST(WebGuard, OtherNamesAreNot) {
  for (const char* host : {"",
                           "evil.example",
                           "localhost.evil.example",
                           "127.0.0.1.evil.example",
                           "127.evil",
                           "127.",
                           "127.:80",
                           "127...",
                           "127.0.0",
                           "127.0.0.",
                           "127.0.0.1.",
                           "127.0.0.1.2",
                           "127.0.0.256",
                           "127.0.0.01",
                           "127.0.0.1000",
                           "127",
                           "localhost:",
                           "localhost:x",
                           "localhost:1:2",
                           "localhost:123456",
                           "[::1",
                           "[::1]x",
                           "[::1]x:80",
                           "::1",
                           "localhost\r\nX: y",
                           "local host",
                           "user@localhost",
                           "localhost/",
                           "0.0.0.0",
                           "[]",
                           "[::ffff:127.0.0.1]"})
    EXPECT_FALSE(is_loopback_host(host)) << host;
}

TEST(WebGuard, AHostThatIsRepeatedInAHeaderHasNoOtherCharacters) {
  EXPECT_TRUE(is_host("sensor-1.lab.example:8137"));
  EXPECT_TRUE(is_host("[fe80::1]:80"));
  for (const char* host : {"a;b", "a b", "a,b", "a\nb", "a'b", "[a;b]", "[::1];", "a_b"})
    EXPECT_FALSE(is_host(host)) << host;
  EXPECT_FALSE(is_host(std::string(300, 'a')));
}

TEST(WebGuard, OnlyTheVeryHostIsTheSameOrigin) {
  EXPECT_TRUE(is_own_origin("http://localhost:8137", "localhost:8137"));
  EXPECT_TRUE(is_own_origin("http://LOCALHOST:8137", "localhost:8137"));
  for (const char* origin :
       {"", "null", "http://localhost", "https://localhost:8137", "http://localhost:81370",
        "http://evil.example", "http://localhost:8137/", "localhost:8137"})
    EXPECT_FALSE(is_own_origin(origin, "localhost:8137")) << origin;
}

TEST(WebGuard, ASocketOfTheOwnPageIsAdmitted) {
  EXPECT_EQ(RequestGuard("").socket(socket_request()), Refusal::none);
}

TEST(WebGuard, ASocketNeedsOriginHostAndProtocol) {
  WebRequest request = socket_request();
  request.origin = "http://evil.example";
  EXPECT_EQ(RequestGuard("").socket(request), Refusal::origin);
  request.origin = "";
  EXPECT_EQ(RequestGuard("").socket(request), Refusal::origin);
  request = socket_request();
  request.host = "evil.example";
  request.origin = "http://evil.example";  // a name that was made to point here
  EXPECT_EQ(RequestGuard("").socket(request), Refusal::host);
  request = socket_request();
  request.protocols = "tagwrench.v2, chat";
  EXPECT_EQ(RequestGuard("").socket(request), Refusal::protocol);
}

TEST(WebGuard, WithATokenTheSocketOffersItAsAProtocol) {
  const RequestGuard guard(kGuardToken);
  WebRequest request = socket_request();
  request.host = "sensor.lab:8137";
  request.origin = "http://sensor.lab:8137";
  EXPECT_EQ(guard.socket(request), Refusal::token);
  const std::string good = std::string("tagwrench.v1, ") + kGuardTokenEntry;
  request.protocols = good;
  EXPECT_EQ(guard.socket(request), Refusal::none);
  for (const std::string bad :
       {"tagwrench.v1,tagwrench.token.", "tagwrench.v1,tagwrench.token.AA",
        "tagwrench.v1,tagwrench.token.MDEyMzQ1Njc4OWFiY2RlZQ", "tagwrench.v1,tagwrench.token.!!"}) {
    request.protocols = bad;
    EXPECT_EQ(guard.socket(request), Refusal::token) << bad;
  }
}

TEST(WebGuard, FilesNeedTheTokenAsBearer) {
  const RequestGuard guard(kGuardToken);
  WebRequest request = socket_request();
  request.target = "/files/recordings/a.twr";
  request.our_user = false;
  EXPECT_EQ(guard.file(request), Refusal::token);
  request.authorization = "Bearer 0123456789abcdef";
  EXPECT_EQ(guard.file(request), Refusal::none);
  request.authorization = "Bearer 0123456789abcdeF";
  EXPECT_EQ(guard.file(request), Refusal::token);
  request.authorization = "Basic 0123456789abcdef";
  EXPECT_EQ(guard.file(request), Refusal::token);
}

TEST(WebGuard, FilesAreNotForOtherSites) {
  const RequestGuard guard("");
  WebRequest request = socket_request();
  request.origin = "";
  EXPECT_EQ(guard.file(request), Refusal::none);  // typed into the address bar
  request.fetch_site = "same-origin";
  EXPECT_EQ(guard.file(request), Refusal::none);
  for (const char* site : {"cross-site", "same-site", "other"}) {
    request.fetch_site = site;
    EXPECT_EQ(guard.file(request), Refusal::origin) << site;
  }
  request.fetch_site = "";
  request.origin = "http://evil.example";
  EXPECT_EQ(guard.file(request), Refusal::origin);
}

TEST(WebGuard, WithoutATokenAnotherUserOfThisComputerGetsNothing) {
  const RequestGuard guard("");
  WebRequest request = socket_request();
  request.our_user = false;
  EXPECT_EQ(guard.page(request), Refusal::user);
  EXPECT_EQ(guard.file(request), Refusal::user);
  EXPECT_EQ(guard.socket(request), Refusal::user);
}

TEST(WebGuard, OurUserNeedsNoTokenUnderANameOfThisComputer) {
  const RequestGuard guard(kGuardToken);
  WebRequest request = socket_request();
  EXPECT_EQ(guard.socket(request), Refusal::none);
  EXPECT_EQ(guard.file(request), Refusal::none);
  request.our_address = "192.0.2.7";
  request.host = "192.0.2.7:8137";
  request.origin = "http://192.0.2.7:8137";
  EXPECT_EQ(guard.socket(request), Refusal::none);
  request.our_address = "192.0.2.8";
  EXPECT_EQ(guard.socket(request), Refusal::token);
  request.host = "evil.example";  // whose owner lets it point here, for a page of his
  request.origin = "http://evil.example";
  EXPECT_EQ(guard.socket(request), Refusal::token);
  EXPECT_EQ(RequestGuard("").page(request), Refusal::host);
}

TEST(WebGuard, AnAddressIsAHostAtAnyPort) {
  EXPECT_TRUE(is_address_host("192.0.2.7", "192.0.2.7"));
  EXPECT_TRUE(is_address_host("192.0.2.7:80", "192.0.2.7"));
  EXPECT_TRUE(is_address_host("[2001:DB8::1]:80", "2001:db8::1"));
  for (const char* host : {"192.0.2.70", "192.0.2.7.evil.example", "[192.0.2.7", "", "2001:db8::1"})
    EXPECT_FALSE(is_address_host(host, "192.0.2.7")) << host;
  EXPECT_FALSE(is_address_host("", ""));
}

TEST(WebGuard, TokensAreComparedWhole) {
  EXPECT_TRUE(is_token("abc", "abc"));
  EXPECT_FALSE(is_token("ab", "abc"));
  EXPECT_FALSE(is_token("abcd", "abc"));
  EXPECT_FALSE(is_token("", "abc"));
  EXPECT_FALSE(is_token(std::string("abc\0", 4), "abc"));
  EXPECT_FALSE(is_token("abc" + std::string(600, '\0'), "abc"));
}

TEST(WebGuard, Base64urlIsDecodedAndNothingElse) {
  EXPECT_EQ(from_base64url("", 9), "");
  EXPECT_EQ(from_base64url("Zg", 9), "f");
  EXPECT_EQ(from_base64url("Zm8", 9), "fo");
  EXPECT_EQ(from_base64url("Zm9v", 9), "foo");
  EXPECT_EQ(from_base64url("-_-_", 9), "\xfb\xff\xbf");
  for (const char* bad : {"Z", "Zg==", "Zh", "Zm9", "Zm 9", "+/+/", "Zm9vA"})
    EXPECT_FALSE(from_base64url(bad, 9)) << bad;
  EXPECT_FALSE(from_base64url("Zm9vZm9v", 5));
}

}  // namespace
}  // namespace tagwrench
