// What a page sends: one request, as text. Pure; the bytes are not trusted.
#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>

namespace tagwrench {

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
