#include "host/tools/packaging/option_values.h"

#include <algorithm>
#include <cctype>
#include <sstream>
#include <string_view>

namespace tagwrench {
namespace {

std::vector<std::string> split(std::string_view text, char separator) {
  std::vector<std::string> parts;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find(separator), text.size());
    parts.emplace_back(text.substr(0, end));
    text.remove_prefix(std::min(end + 1, text.size()));
  }
  return parts;
}

/// "sim:SCENARIO.yaml" -> "sim:", "spnav[:PATH]" -> "spnav", "v4l2:/dev/videoN[...]" -> "v4l2:".
std::string fixed_part(std::string_view word) {
  const std::size_t end = word.find_first_of("[:");
  if (end == std::string_view::npos) return std::string(word);
  return std::string(word.substr(0, word[end] == ':' ? end + 1 : end));
}

void add_once(std::vector<std::string>& words, std::string word) {
  if (!word.empty() && std::find(words.begin(), words.end(), word) == words.end())
    words.push_back(std::move(word));
}

/// "  jsonl:FILE, csv:FILE          one line per frame" -> jsonl:, csv:
void add_from_line(std::string_view line, std::vector<std::string>& words) {
  line.remove_prefix(line.find_first_not_of(' '));
  const std::string_view head = line.substr(0, line.find("  "));
  std::istringstream parts{std::string(head)};
  for (std::string part; parts >> part;) {
    if (part == "|") continue;
    if (part.back() == ',') part.pop_back();
    add_once(words, fixed_part(part));
  }
}

}  // namespace

std::string value_name(const command_line::Option& option) {
  const std::string type = option.value_type();
  const std::size_t set = type.find('{');
  if (set != std::string::npos) return type.substr(set, type.find('}') + 1 - set);
  return type.substr(0, type.find(':'));
}

std::vector<std::string> value_choices(const command_line::Option& option) {
  std::vector<std::string> words;
  const std::string name = value_name(option);
  if (!name.empty() && name.front() == '{') return split(name.substr(1, name.size() - 2), ',');
  for (const std::string& line : split(option.description(), '\n')) {
    if (line.starts_with("  ")) add_from_line(line, words);
  }
  return words;
}

}  // namespace tagwrench
