// Where pages are served, and how patiently.
#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <string>

#include "host/core/types.h"

namespace tagwrench {

/// How long is waited for what a page, or whoever connects, owes.
struct WebPatience {
  Duration header = std::chrono::seconds(4);    ///< for a request, once it has begun
  Duration request = std::chrono::seconds(10);  ///< for a request to begin, and for a piece of an
                                                ///< answer to be taken
  Duration unread = std::chrono::seconds(10);   ///< for a page's message to be taken
  Duration ping = std::chrono::seconds(5);      ///< from one ping to the next
  Duration silence = std::chrono::seconds(15);  ///< for anything to be heard from a page
};

struct WebOptions {
  std::string address = "127.0.0.1";    ///< a number, or "localhost"
  std::uint16_t port = 8137;            ///< 0: any that is free
  std::string token{};                  ///< empty: none, which a loopback address alone allows
  std::filesystem::path pages{};        ///< holds dashboard/, sensor/ and flip/, as far as built
  std::string option = "--output web";  ///< that said so, for complaints
  WebPatience patience{};
};

// Where pages are served, from what is said on the command line.

/// `place`: "", "ADDRESS:PORT", an address with colons of its own in brackets. Throws ConfigError,
/// which begins with `option` ("--output web").
WebOptions parse_web(const std::string& option, const std::string& place);

/// Installed, or as they were built: beside the program.
std::filesystem::path built_pages();

// The token that a page on another computer needs.

/// Of a file of ours (or root's) that its owner alone may read; made, with 43 random characters,
/// where there is none. Throws ConfigError: it is another's, others may read it, it is no token (16
/// to 128 letters, digits, '-', '_',
/// '.' and '~'), or it cannot be written.
std::string web_token(const std::filesystem::path& file);

/// On a terminal the token; where standard error is a log, which others may read, where it is.
std::string token_for_people(const std::string& token, const std::filesystem::path& file);

}  // namespace tagwrench
