// What anybody may send to the pages' server: a request, and on lines of their own a request's
// target, Host, Origin, protocols and Authorization.
#include <algorithm>
#include <cstdint>
#include <string>
#include <string_view>

#include "host/web/server/request_guard.h"
#include "tests/fuzz/expect.h"

namespace {

using namespace tagwrench;

constexpr std::string_view kToken = "0123456789abcdef";

void check_request(std::string_view text) {
  const PageMessage request = parse_page_message(text);
  if (!request.fault.empty()) return;
  expect(request.id && *request.id >= 0, "a request has an id");
  expect(!request.what.empty() && request.what.size() <= 32, "a request is a word");
  expect(request.arguments.is_object() && request.arguments.size() <= PageMessage::kMaxArguments,
         "arguments are some");
  expect(!request.arguments.contains("id") && !request.arguments.contains("ask"),
         "arguments are those of the request alone");
  // Shown to others again: what was taken can be told.
  const std::string told = nlohmann::json{{"id", *request.id}, {"ask", request.what}}.dump();
  const PageMessage again = parse_page_message(told);
  expect(again.id == request.id && again.what == request.what,
         "a request that is told is the same request");
}

void check_target(std::string_view target) {
  const auto path = parse_target(target);
  if (!path) return;
  const std::string text = path->text();
  expect(text.front() == '/', "a path is absolute");
  for (const std::string& name : path->names) {
    expect(is_file_name(name), "a name is a file's");
    expect(name.find('/') == std::string::npos && name != ".." && name.front() != '.',
           "a name stays in its folder");
  }
  const auto again = parse_target(text);
  expect(again && again->names == path->names && again->folder == path->folder,
         "a path that is told is the same path");
}

void check_headers(const WebRequest& request) {
  const bool harmless = std::all_of(request.host.begin(), request.host.end(), [](char c) {
    return c > ' ' && c < 127 && c != ';' && c != ',' && c != '\'' && c != '"';
  });
  expect(!is_host(request.host) || harmless, "a host can be repeated in a header");
  expect(!is_loopback_host(request.host) || is_host(request.host), "loopback is a host");
  expect(!is_own_origin(request.origin, request.host) ||
             request.origin.size() == request.host.size() + 7,
         "the own origin is the host");
  const RequestGuard open("");
  const RequestGuard closed{std::string(kToken)};
  if (open.socket(request) == Refusal::none)
    expect(is_loopback_host(request.host) && is_own_origin(request.origin, request.host),
           "without a token, pages of this computer alone");
  if (closed.file(request) == Refusal::none)
    expect(request.authorization.find(kToken) != std::string_view::npos, "a file needs the token");
  if (closed.socket(request) == Refusal::none)
    expect(protocol_token(request.protocols) == kToken, "a socket needs the token");
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t count) {
  const std::string_view text(reinterpret_cast<const char*>(bytes), count);
  check_request(text);
  std::string_view lines[5];
  std::string_view left = text;
  for (std::string_view& line : lines) {
    const std::size_t end = std::min(left.find('\n'), left.size());
    line = left.substr(0, end);
    left.remove_prefix(std::min(end + 1, left.size()));
  }
  check_target(lines[0]);
  WebRequest request{};
  request.host = lines[1];
  request.origin = lines[2];
  request.protocols = lines[3];
  request.authorization = lines[4];
  check_headers(request);
  const auto decoded = from_base64url(text, 100);
  expect(!decoded || decoded->size() <= 100, "what is decoded is bounded");
  return 0;
}
