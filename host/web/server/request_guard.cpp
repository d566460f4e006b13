#include "host/web/server/request_guard.h"

#include <algorithm>
#include <array>

namespace tagwrench {
namespace {

constexpr std::size_t kMaxHost = 261;  // a name of 255, and a port
constexpr std::size_t kMaxToken = 512;

bool is_alphanumeric(char c) {
  return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z');
}

char lower(char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; }

bool same_letters(std::string_view a, std::string_view b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                    [](char x, char y) { return lower(x) == lower(y); });
}

bool is_digits(std::string_view text, std::size_t most) {
  const auto is_digit = [](char c) { return c >= '0' && c <= '9'; };
  return !text.empty() && text.size() <= most && std::all_of(text.begin(), text.end(), is_digit);
}

bool is_port(std::string_view port) { return is_digits(port, 5); }

/// 127.0.0.0/8 as browsers spell it: four numbers up to 255, without zeros before them.
bool is_loopback_number(std::string_view name) {
  if (!name.starts_with("127.")) return false;
  for (int dots = 3;; --dots) {
    const std::size_t end = std::min(name.find('.'), name.size());
    const std::string_view number = name.substr(0, end);
    const bool is_byte = is_digits(number, 3) && (number.size() < 3 || number <= "255");
    if (!is_byte || (number.size() > 1 && number.front() == '0')) return false;
    if (end == name.size()) return dots == 0;
    name.remove_prefix(end + 1);
  }
}

/// "name", "name:port", "[number]" and "[number]:port" without the port; empty: none of these.
std::string_view host_name(std::string_view host) {
  if (host.empty() || host.size() > kMaxHost) return {};
  const std::size_t bracket = host.front() == '[' ? host.find(']') : 0;
  if (bracket == std::string_view::npos) return {};
  const std::size_t colon = host.find(':', bracket);
  if (colon == std::string_view::npos) return host.substr(0, bracket > 0 ? bracket + 1 : colon);
  return is_port(host.substr(colon + 1)) ? host.substr(0, colon) : std::string_view{};
}

std::string_view trimmed_blanks(std::string_view text) {
  while (!text.empty() && (text.front() == ' ' || text.front() == '\t')) text.remove_prefix(1);
  while (!text.empty() && (text.back() == ' ' || text.back() == '\t')) text.remove_suffix(1);
  return text;
}

/// Calls `visit` with each entry of a comma-separated list until it returns true.
template <typename Visit>
bool any_entry(std::string_view list, Visit visit) {
  while (!list.empty()) {
    const std::size_t comma = std::min(list.find(','), list.size());
    if (visit(trimmed_blanks(list.substr(0, comma)))) return true;
    list.remove_prefix(std::min(comma + 1, list.size()));
  }
  return false;
}

int base64url_value(char c) {
  if (c >= 'A' && c <= 'Z') return c - 'A';
  if (c >= 'a' && c <= 'z') return c - 'a' + 26;
  if (c >= '0' && c <= '9') return c - '0' + 52;
  if (c == '-') return 62;
  return c == '_' ? 63 : -1;
}

}  // namespace

bool is_host(std::string_view host) noexcept {
  const std::string_view name = host_name(host);
  if (name.empty()) return false;
  if (name.front() != '[')
    return std::all_of(name.begin(), name.end(),
                       [](char c) { return is_alphanumeric(c) || c == '-' || c == '.'; });
  if (name.back() != ']' || name.size() < 4) return false;
  const std::string_view number = name.substr(1, name.size() - 2);
  return std::all_of(number.begin(), number.end(),
                     [](char c) { return is_alphanumeric(c) || c == ':' || c == '.'; }) &&
         (host.size() == name.size() || host[name.size()] == ':');
}

bool is_loopback_host(std::string_view host) noexcept {
  if (!is_host(host)) return false;
  const std::string_view name = host_name(host);
  return same_letters(name, "localhost") || name == "[::1]" || is_loopback_number(name);
}

bool is_own_origin(std::string_view origin, std::string_view host) noexcept {
  constexpr std::string_view kScheme = "http://";
  return origin.substr(0, kScheme.size()) == kScheme &&
         same_letters(origin.substr(kScheme.size()), host);
}

bool is_token(std::string_view given, std::string_view token) noexcept {
  unsigned difference = given.size() == token.size() ? 0 : 1;
  for (std::size_t i = 0; i < kMaxToken; ++i) {
    const char mine = i < token.size() ? token[i] : '\0';
    const char his = i < given.size() ? given[i] : '\0';
    difference |= static_cast<unsigned char>(mine ^ his);
  }
  return difference == 0 && given.size() <= kMaxToken;
}

std::string_view bearer_token(std::string_view authorization) noexcept {
  constexpr std::string_view kScheme = "bearer ";
  if (!same_letters(authorization.substr(0, kScheme.size()), kScheme)) return {};
  return trimmed_blanks(authorization.substr(kScheme.size()));
}

bool offers_protocol(std::string_view protocols, std::string_view wanted) noexcept {
  return any_entry(protocols, [&](std::string_view entry) { return entry == wanted; });
}

std::optional<std::string> protocol_token(std::string_view protocols) {
  std::optional<std::string> token;
  any_entry(protocols, [&](std::string_view entry) {
    if (entry.substr(0, RequestGuard::kTokenProtocol.size()) != RequestGuard::kTokenProtocol)
      return false;
    token = from_base64url(entry.substr(RequestGuard::kTokenProtocol.size()), kMaxToken);
    return true;
  });
  return token;
}

std::optional<std::string> from_base64url(std::string_view text, std::size_t most) {
  if (text.size() % 4 == 1 || text.size() / 4 * 3 + text.size() % 4 > most + 1) return {};
  std::string bytes;
  unsigned bits = 0;
  int count = 0;
  for (const char c : text) {
    const int value = base64url_value(c);
    if (value < 0) return {};
    bits = (bits << 6 | static_cast<unsigned>(value)) & 0xffffU;
    count += 6;
    if (count < 8) continue;
    count -= 8;
    bytes += static_cast<char>(bits >> count & 0xffU);
  }
  const bool clean = (bits & ((1U << count) - 1)) == 0;
  if (!clean || bytes.size() > most) return {};
  return bytes;
}

Refusal RequestGuard::page(const WebRequest& request) const noexcept {
  const bool known = token_.empty() ? is_loopback_host(request.host) : is_host(request.host);
  return known ? Refusal::none : Refusal::host;
}

Refusal RequestGuard::file(const WebRequest& request) const noexcept {
  if (const Refusal refusal = page(request); refusal != Refusal::none) return refusal;
  const bool foreign = !request.fetch_site.empty() && request.fetch_site != "same-origin" &&
                       request.fetch_site != "none";
  if (foreign || (!request.origin.empty() && !is_own_origin(request.origin, request.host)))
    return Refusal::origin;
  if (!token_.empty() && !is_token(bearer_token(request.authorization), token_))
    return Refusal::token;
  return Refusal::none;
}

Refusal RequestGuard::socket(const WebRequest& request) const {
  if (const Refusal refusal = page(request); refusal != Refusal::none) return refusal;
  if (!is_own_origin(request.origin, request.host)) return Refusal::origin;
  if (!offers_protocol(request.protocols, kProtocol)) return Refusal::protocol;
  if (!token_.empty() && !is_token(protocol_token(request.protocols).value_or(""), token_))
    return Refusal::token;
  return Refusal::none;
}

}  // namespace tagwrench
