// The token that a page on another computer needs.
#pragma once

#include <filesystem>
#include <string>

namespace tagwrench {

struct WebToken {
  std::string text;
  bool made = false;  ///< now; it was not there
};

/// Of a file that its owner alone may read; made, with 43 random characters, where there is none.
/// Throws ConfigError: others may read it, it is no token (16 to 128 letters, digits, '-', '_',
/// '.' and '~'), or it cannot be written.
WebToken web_token(const std::filesystem::path& file);

}  // namespace tagwrench
