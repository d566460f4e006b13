// Who may ask: Host, Origin and token of a request, as its headers spell them. Pure; everything
// here is what a stranger sent.
#pragma once

#include <cstdint>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "host/core/os/unique_fd.h"

namespace tagwrench {

/// What decides about a request. Views into it.
struct WebRequest {
  std::string_view method;
  std::string_view target;
  std::string_view host;
  std::string_view origin;
  std::string_view fetch_site;  ///< Sec-Fetch-Site
  std::string_view authorization;
  std::string_view protocols;  ///< Sec-WebSocket-Protocol
  std::string_view if_none_match;
  bool upgrade = false;          ///< to a WebSocket
  bool our_user = false;         ///< a program of ours, or of root's, holds the other end
  std::string_view our_address;  ///< a number: where the connection arrived
};

enum class Refusal : std::uint8_t {
  none,
  host,      ///< not this computer's name: another site's, that was made to point here
  origin,    ///< another site's page asks
  token,     ///< none, or the wrong one
  user,      ///< another user of this computer, or nobody knows who; and there is no token
  protocol,  ///< does not speak ours
  path,      ///< would leave the folder
  crowd,     ///< too many pages or connections
  flood,     ///< too much, too often or too large
  nonsense,  ///< not HTTP, not WebSocket, not a request
};

/// A name or a number with at most a port, and nothing else: safe to be repeated in a header.
bool is_host(std::string_view host) noexcept;
/// localhost, [::1] or an address 127.x.x.x, at any port: a tunnel has its own.
bool is_loopback_host(std::string_view host) noexcept;
/// The number `address`, at any port; an IPv6 one in brackets.
bool is_address_host(std::string_view host, std::string_view address) noexcept;
/// "http://" and the very host.
bool is_own_origin(std::string_view origin, std::string_view host) noexcept;

/// Takes as long for a wrong token as for the right one.
bool is_token(std::string_view given, std::string_view token) noexcept;
/// Of "Bearer TOKEN".
std::string_view bearer_token(std::string_view authorization) noexcept;
/// Whether the comma-separated list has this protocol.
bool offers_protocol(std::string_view protocols, std::string_view wanted) noexcept;
/// Of "tagwrench.token.<base64url>" in the list.
std::optional<std::string> protocol_token(std::string_view protocols);
/// Nothing: not base64url without padding (RFC 4648, section 5), or longer than `most` bytes.
std::optional<std::string> from_base64url(std::string_view text, std::size_t most);

class RequestGuard {
 public:
  static constexpr std::string_view kProtocol = "tagwrench.v1";
  static constexpr std::string_view kTokenProtocol = "tagwrench.token.";

  /// Whoever runs the bridge needs no token on this computer, under a name that nobody can give to
  /// another's page: a loopback one, or the number where the connection arrived. Everybody else
  /// needs it; without one, nobody else is served at all, and Host must be such a name.
  explicit RequestGuard(std::string token) : token_(std::move(token)) {}

  /// A plain page holds no secret: with a token, anybody may have it.
  Refusal page(const WebRequest& request) const noexcept;
  /// What the bridge has written: recordings, the certificate.
  Refusal file(const WebRequest& request) const noexcept;
  Refusal socket(const WebRequest& request) const;

 private:
  bool knows(const WebRequest& request, std::string_view token) const noexcept;

  std::string token_;
};

// From the target of a request to a file, and no other file. Pure but for open_confined().

/// The parts of a path between slashes, decoded: names of letters, digits and "-_.~@+", none of
/// which begins with a dot.
struct SitePath {
  std::vector<std::string> names;
  bool folder = false;  ///< ends with a slash

  /// "/a/b", or "/a/b/" if it is a folder.
  std::string text() const;
};

/// Nothing: not the absolute path of one host's resource, or anything that could leave a folder or
/// mean something else to somebody else (dots, escapes of these, backslashes, zeros). A query does
/// not count.
std::optional<SitePath> parse_target(std::string_view target);

bool is_file_name(std::string_view name) noexcept;

struct OpenedFile {
  UniqueFd fd;
  std::uint64_t size = 0;
  std::int64_t changed_ns = 0;
};

/// A regular file below `folder`, on a way without symbolic links.
std::optional<OpenedFile> open_confined(const std::filesystem::path& folder,
                                        const std::vector<std::string>& names);

// What a page sends: one request, as text. Pure; the bytes are not trusted.

// What a page requests.

/// A page's request, as far as any page's request is checked: `what` is a word of lower-case
/// letters and underscores, `arguments` an object without "id" and "ask", nested no deeper than
/// eight.
struct PageRequest {
  std::uint64_t page = 0;
  std::int64_t id = 0;
  std::string what;
  nlohmann::json arguments;
};

struct PageMessage {
  static constexpr std::size_t kDeepest = 8;
  static constexpr std::size_t kMaxArguments = 32;

  std::optional<std::int64_t> id;  ///< without one, there is nobody to answer
  std::string what;
  nlohmann::json arguments;
  std::string_view fault;  ///< empty: it is a request. Else what is wrong with it, in words
};

PageMessage parse_page_message(std::string_view text);

}  // namespace tagwrench
