#include "host/web/server/request_guard.h"

#include <arpa/inet.h>
#include <fcntl.h>
#include <strings.h>
#include <sys/stat.h>

#include <algorithm>

#include "host/core/json/json_text.h"
#include "host/core/parse.h"

namespace tagwrench {
namespace {

constexpr std::size_t kMaxHost = 261;  // a name of 255, and a port
constexpr std::size_t kMaxToken = 512;
constexpr std::string_view kBlanks = " \t";  // of headers

bool is_alphanumeric(char c) {
  return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z');
}

bool same_letters(std::string_view a, std::string_view b) {
  return a.size() == b.size() && ::strncasecmp(a.data(), b.data(), a.size()) == 0;
}

bool is_port(std::string_view port) {
  const auto is_digit = [](char c) { return c >= '0' && c <= '9'; };
  return !port.empty() && port.size() <= 5 && std::all_of(port.begin(), port.end(), is_digit);
}

/// 127.0.0.0/8 as browsers spell it: four numbers up to 255, without zeros before them.
bool is_loopback_number(std::string_view name) {
  in_addr address{};
  return ::inet_pton(AF_INET, std::string(name).c_str(), &address) == 1 &&
         ntohl(address.s_addr) >> 24 == 127;
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

int base64url_value(char c) {
  if (c >= 'A' && c <= 'Z') return c - 'A';
  if (c >= 'a' && c <= 'z') return c - 'a' + 26;
  if (c >= '0' && c <= '9') return c - '0' + 52;
  if (c == '-') return 62;
  return c == '_' ? 63 : -1;
}

constexpr std::size_t kMaxTarget = 1024;
constexpr std::size_t kDeepestFolder = 8;

/// Once: what is still an escape then is no character of a name.
std::optional<std::string> unescaped(std::string_view text) {
  std::string out;
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text[i] != '%') {
      out += text[i];
      continue;
    }
    const std::string_view digits = text.substr(i + 1, 2);
    const auto byte = parse_whole<unsigned char>(digits, 16);
    if (digits.size() < 2 || !byte) return {};
    out += static_cast<char>(*byte);
    i += 2;
  }
  return out;
}

using nlohmann::json;

constexpr std::int64_t kMaxId = std::int64_t{1} << 53;  // a page's numbers are doubles
constexpr std::size_t kMaxWord = 32;

/// Before it is parsed: what it is nested into is freed and copied by recursion.
std::size_t deepest(std::string_view text) {
  std::size_t depth = 0;
  std::size_t most = 0;
  bool quoted = false;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    if (quoted && c == '\\') ++i;
    if (c == '"') quoted = !quoted;
    if (quoted) continue;
    if (c == '{' || c == '[') most = std::max(most, ++depth);
    if ((c == '}' || c == ']') && depth > 0) --depth;
  }
  return most;
}

std::optional<std::int64_t> id_of(const json& message) {
  const auto id = message.find("id");
  if (id == message.end() || !id->is_number_integer()) return {};
  if (id->is_number_unsigned() && id->get<std::uint64_t>() > std::uint64_t{kMaxId}) return {};
  const auto value = id->get<std::int64_t>();
  if (value < 0 || value > kMaxId) return {};
  return value;
}

bool is_word(std::string_view word) {
  return !word.empty() && word.size() <= kMaxWord &&
         std::all_of(word.begin(), word.end(),
                     [](char c) { return (c >= 'a' && c <= 'z') || c == '_'; });
}

/// By a name that nobody else can give to his own page, as a DNS name could be.
bool is_this_computer(const WebRequest& request) noexcept {
  return is_loopback_host(request.host) || is_address_host(request.host, request.our_address);
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

bool is_address_host(std::string_view host, std::string_view address) noexcept {
  if (address.empty() || !is_host(host)) return false;
  std::string_view name = host_name(host);
  if (name.front() == '[') name = name.substr(1, name.size() - 2);
  return same_letters(name, address);
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
  return trimmed(authorization.substr(kScheme.size()), kBlanks);
}

bool offers_protocol(std::string_view protocols, std::string_view wanted) noexcept {
  const std::vector<std::string_view> all = split(protocols, ',');
  return std::any_of(all.begin(), all.end(),
                     [&](std::string_view entry) { return trimmed(entry, kBlanks) == wanted; });
}

std::optional<std::string> protocol_token(std::string_view protocols) {
  for (std::string_view entry : split(protocols, ',')) {
    entry = trimmed(entry, kBlanks);
    if (entry.starts_with(RequestGuard::kTokenProtocol))
      return from_base64url(entry.substr(RequestGuard::kTokenProtocol.size()), kMaxToken);
  }
  return {};
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

bool RequestGuard::knows(const WebRequest& request, std::string_view token) const noexcept {
  if (request.our_user && is_this_computer(request)) return true;
  return !token_.empty() && is_token(token, token_);
}

Refusal RequestGuard::page(const WebRequest& request) const noexcept {
  if (!(token_.empty() ? is_this_computer(request) : is_host(request.host))) return Refusal::host;
  return token_.empty() && !request.our_user ? Refusal::user : Refusal::none;
}

Refusal RequestGuard::file(const WebRequest& request) const noexcept {
  if (const Refusal refusal = page(request); refusal != Refusal::none) return refusal;
  const bool foreign = !request.fetch_site.empty() && request.fetch_site != "same-origin" &&
                       request.fetch_site != "none";
  if (foreign || (!request.origin.empty() && !is_own_origin(request.origin, request.host)))
    return Refusal::origin;
  return knows(request, bearer_token(request.authorization)) ? Refusal::none : Refusal::token;
}

Refusal RequestGuard::socket(const WebRequest& request) const {
  if (const Refusal refusal = page(request); refusal != Refusal::none) return refusal;
  if (!is_own_origin(request.origin, request.host)) return Refusal::origin;
  if (!offers_protocol(request.protocols, kProtocol)) return Refusal::protocol;
  return knows(request, protocol_token(request.protocols).value_or("")) ? Refusal::none
                                                                        : Refusal::token;
}

std::string SitePath::text() const {
  std::string out;
  for (const std::string& name : names) out += '/' + name;
  return folder || out.empty() ? out + '/' : out;
}

bool is_file_name(std::string_view name) noexcept {
  constexpr std::string_view kMarks = "-_.~@+";
  const auto fits = [&](char c) {
    return is_alphanumeric(c) || kMarks.find(c) != std::string_view::npos;
  };
  return !name.empty() && name.size() <= 255 && name.front() != '.' &&
         std::all_of(name.begin(), name.end(), fits);
}

std::optional<SitePath> parse_target(std::string_view target) {
  if (target.empty() || target.front() != '/' || target.size() > kMaxTarget) return {};
  std::string_view left = target.substr(1, std::min(target.find('?'), target.size()) - 1);
  SitePath path;
  path.folder = left.empty() || left.back() == '/';
  while (!left.empty()) {
    const std::size_t end = std::min(left.find('/'), left.size());
    std::optional<std::string> name = unescaped(left.substr(0, end));
    if (!name || !is_file_name(*name) || path.names.size() == kDeepestFolder) return {};
    path.names.push_back(*std::move(name));
    left.remove_prefix(std::min(end + 1, left.size()));
  }
  return path;
}

std::optional<OpenedFile> open_confined(const std::filesystem::path& folder,
                                        const std::vector<std::string>& names) {
  constexpr int kSafely = O_RDONLY | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK;
  UniqueFd at(::open(folder.c_str(), O_RDONLY | O_CLOEXEC | O_DIRECTORY));
  for (const std::string& name : names) {
    if (!at || !is_file_name(name)) return {};
    at.reset(::openat(at.get(), name.c_str(), kSafely));
  }
  struct stat facts {};
  if (!at || ::fstat(at.get(), &facts) != 0 || !S_ISREG(facts.st_mode)) return {};
  return OpenedFile{std::move(at), static_cast<std::uint64_t>(facts.st_size),
                    facts.st_mtim.tv_sec * std::int64_t{1'000'000'000} + facts.st_mtim.tv_nsec};
}

PageMessage parse_page_message(std::string_view text) {
  PageMessage out;
  if (deepest(text) > PageMessage::kDeepest) {
    out.fault = "nested too deeply";
    return out;
  }
  json message = parse_json(text);
  if (!message.is_object()) {
    out.fault = "not a JSON object";
    return out;
  }
  out.id = id_of(message);
  const auto what = message.find("ask");
  const auto* const word = what == message.end() ? nullptr : what->get_ptr<const std::string*>();
  if (!out.id)
    out.fault = "no id: a whole number, not negative";
  else if (word == nullptr || !is_word(*word))
    out.fault = "no ask: a word of lower-case letters";
  else if (message.size() > PageMessage::kMaxArguments + 2)
    out.fault = "too many arguments";
  if (!out.fault.empty()) return out;
  out.what = *word;
  message.erase("id");
  message.erase("ask");
  out.arguments = std::move(message);
  return out;
}

}  // namespace tagwrench
