// JSON as text, for all rooms: the library's parser and serializer, compiled once.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>

namespace tagwrench {

/// Of bytes that a stranger may have written: what is no JSON gives a value that is_discarded(),
/// which is neither object nor array. Throws for want of memory only.
nlohmann::json parse_json(std::string_view text);
/// The same, its keys in the order of the text.
nlohmann::ordered_json parse_ordered_json(std::string_view text);

/// Indented by `indent` spaces a level; -1: on one line. Bytes that are no UTF-8 become U+FFFD.
std::string dump_json(const nlohmann::json& value, int indent = -1);
std::string dump_json(const nlohmann::ordered_json& value, int indent = -1);

}  // namespace tagwrench
