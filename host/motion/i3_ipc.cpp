#include "host/motion/i3_ipc.h"

#include <algorithm>
#include <cstring>
#include <nlohmann/json.hpp>
#include <vector>

#include "host/core/json/json_text.h"
#include "host/motion/focus_watch.h"

namespace tagwrench {
namespace {

using Json = nlohmann::json;

constexpr std::string_view kMagic = "i3-ipc";
constexpr std::size_t kMaxName = 256;

std::uint32_t word_at(std::string_view bytes, std::size_t at) {
  std::uint32_t word = 0;
  std::memcpy(&word, bytes.data() + at, sizeof word);
  return word;
}

/// The text of a key, empty if there is none.
std::string text_of(const Json& object, const char* key) {
  const auto found = object.find(key);
  if (found == object.end() || !found->is_string()) return {};
  return found->get_ref<const std::string&>().substr(0, kMaxName);
}

/// A window of Wayland has an application id, one of X11 a class.
std::string program_of(const Json& window) {
  std::string name = text_of(window, "app_id");
  const auto properties = window.find("window_properties");
  if (name.empty() && properties != window.end() && properties->is_object())
    name = text_of(*properties, "class");
  return lower_case(name);
}

bool is_true(const Json& object, const char* key) {
  const auto found = object.find(key);
  return found != object.end() && found->is_boolean() && found->get<bool>();
}

/// Without recursion: whoever writes the tree says how deep it is.
std::optional<Focus> focused_in(const Json& tree) {
  std::vector<const Json*> left = {&tree};
  while (!left.empty()) {
    const Json& node = *left.back();
    left.pop_back();
    if (!node.is_object()) continue;
    // A workspace without windows can have the focus itself.
    if (is_true(node, "focused")) return Focus{.told = true, .program = program_of(node)};
    for (const char* key : {"nodes", "floating_nodes"}) {
      const auto children = node.find(key);
      if (children == node.end() || !children->is_array()) continue;
      for (const Json& child : *children) left.push_back(&child);
    }
  }
  return {};
}

}  // namespace

std::string i3_message(I3Type type, std::string_view payload) {
  const auto size = static_cast<std::uint32_t>(payload.size());
  std::string bytes(kMagic);
  bytes.append(reinterpret_cast<const char*>(&size), sizeof size);
  bytes.append(reinterpret_cast<const char*>(&type), sizeof type);
  return bytes.append(payload);
}

bool I3Stream::put(std::string_view bytes) {
  const std::size_t over = std::min(passed_over_, bytes.size());
  passed_over_ -= over;
  bytes_.append(bytes.substr(over));
  const std::string_view begin = std::string_view(bytes_).substr(0, kMagic.size());
  return kMagic.starts_with(begin);
}

std::optional<I3Message> I3Stream::next() {
  if (bytes_.size() < kHead || !bytes_.starts_with(kMagic)) return {};
  const std::size_t size = word_at(bytes_, kMagic.size());
  I3Message message{word_at(bytes_, kMagic.size() + 4), {}};
  if (size > kMax) {
    const std::size_t here = std::min(size, bytes_.size() - kHead);
    passed_over_ = size - here;
    bytes_.erase(0, kHead + here);
    return message;
  }
  if (bytes_.size() < kHead + size) return {};
  message.payload = bytes_.substr(kHead, size);
  bytes_.erase(0, kHead + size);
  return message;
}

std::optional<Focus> focus_in(const I3Message& message) {
  const Json json = parse_json(message.payload);
  if (!json.is_object()) return {};
  if (message.type == static_cast<std::uint32_t>(I3Type::tree)) return focused_in(json);
  if (message.type != static_cast<std::uint32_t>(I3Type::window_event)) return {};
  const auto window = json.find("container");
  if (text_of(json, "change") != "focus" || window == json.end() || !window->is_object()) return {};
  return Focus{.told = true, .program = program_of(*window)};
}

}  // namespace tagwrench
