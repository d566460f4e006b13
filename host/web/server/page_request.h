// What a page requests.
#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>

namespace tagwrench {

/// A page's request, as far as any page's request is checked: `what` is a word of lower-case
/// letters and underscores, `arguments` an object without "id" and "ask", nested no deeper than
/// eight.
struct PageRequest {
  std::uint64_t page = 0;
  std::int64_t id = 0;
  std::string what;
  nlohmann::json arguments;
};

}  // namespace tagwrench
