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
  Duration request = std::chrono::seconds(10);  ///< for a request, and for a piece of an answer to
                                                ///< be taken
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

}  // namespace tagwrench
