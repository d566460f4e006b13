// Who may ask: Host, Origin and token of a request, as its headers spell them. Pure; everything
// here is what a stranger sent.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

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
  bool upgrade = false;  ///< to a WebSocket
};

enum class Refusal : std::uint8_t {
  none,
  host,      ///< not this computer's name: another site's, that was made to point here
  origin,    ///< another site's page asks
  token,     ///< none, or the wrong one
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

  /// Without a token, none is needed, and Host must be a loopback one.
  explicit RequestGuard(std::string token) : token_(std::move(token)) {}

  /// Anybody's plain page: it holds no secret.
  Refusal page(const WebRequest& request) const noexcept;
  /// What the bridge has written: recordings, the certificate.
  Refusal file(const WebRequest& request) const noexcept;
  Refusal socket(const WebRequest& request) const;

 private:
  std::string token_;
};

}  // namespace tagwrench
