#include "host/web/server/page_message.h"

#include <algorithm>

#include "host/core/json/json_text.h"

namespace tagwrench {
namespace {

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

}  // namespace

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
