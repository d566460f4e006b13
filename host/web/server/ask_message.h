// What a page sends: one wish, as text. Pure; the bytes are not trusted.
#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>

namespace tagwrench {

struct AskMessage {
  static constexpr std::size_t kDeepest = 8;
  static constexpr std::size_t kMostArguments = 32;

  std::optional<std::int64_t> id;  ///< without one, there is nobody to answer
  std::string what;
  nlohmann::json arguments;
  std::string_view fault;  ///< empty: it is a wish. Else what is wrong with it, in words
};

AskMessage parse_ask(std::string_view text);

}  // namespace tagwrench
