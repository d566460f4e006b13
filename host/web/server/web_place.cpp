#include "host/web/server/web_place.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <system_error>

#include "host/core/config_error.h"

namespace tagwrench {

WebOptions parse_web(const std::string& option, const std::string& place) {
  WebOptions options;
  options.option = option;
  if (place.empty()) return options;
  const std::size_t colon = place.rfind(':');
  const char* end = place.data() + place.size();
  const char* digits = place.data() + std::min(colon, place.size() - 1) + 1;
  const auto [parsed, error] = std::from_chars(digits, end, options.port);
  options.address = place.substr(0, std::min(colon, place.size()));
  if (options.address.size() >= 2 && options.address.front() == '[' &&
      options.address.back() == ']')
    options.address = options.address.substr(1, options.address.size() - 2);
  if (colon == std::string::npos || options.address.empty() || parsed != end ||
      error != std::errc()) {
    throw ConfigError(
        fmt::format("{}:{}: is no ADDRESS:PORT; use web, or web:127.0.0.1:8137", option, place));
  }
  return options;
}

std::filesystem::path built_pages() {
  std::error_code error;
  const std::filesystem::path program = std::filesystem::read_symlink("/proc/self/exe", error);
  const std::filesystem::path above = program.parent_path().parent_path();
  const std::filesystem::path installed = above / "share/tagwrench/web";
  return std::filesystem::is_directory(installed, error) ? installed : above / "web";
}

}  // namespace tagwrench
