#include "host/tools/reading/hid_list.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <fstream>
#include <iterator>
#include <optional>
#include <string_view>
#include <system_error>

#include "host/core/config_error.h"
#include "host/tools/reading/hid_text.h"
#include "host/tools/reading/six_axis.h"
#include "host/tools/reading/tagwrench_hid.h"

namespace tagwrench {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMaxBytes = 4096;  // of an attribute; HID_MAX_DESCRIPTOR_SIZE is the same

/// Nothing where it cannot be read: the device went.
std::optional<std::string> attribute(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  std::string bytes(kMaxBytes, '\0');
  file.read(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  if (!file.is_open() || file.bad() || file.gcount() == 0) return std::nullopt;
  bytes.resize(static_cast<std::size_t>(file.gcount()));
  return bytes;
}

/// One character of UTF-8 (RFC 3629), taken off `text`; '?' for a byte that begins none.
wchar_t next_character(std::string_view& text) {
  const auto first = static_cast<unsigned char>(text.front());
  const std::size_t size = first < 0x80    ? 1
                           : first < 0xc2  ? 0
                           : first < 0xe0  ? 2
                           : first < 0xf0  ? 3
                           : first <= 0xf4 ? 4
                                           : 0;
  std::uint32_t character = size < 2 ? first : first & (0x7fU >> size);
  bool whole = size > 0 && size <= text.size();
  for (std::size_t i = 1; whole && i < size; ++i) {
    const auto byte = static_cast<unsigned char>(text[i]);
    whole = (byte & 0xc0U) == 0x80U;
    character = character << 6 | (byte & 0x3fU);
  }
  constexpr std::array<std::uint32_t, 5> kMin{0, 0, 0x80, 0x800, 0x10000};
  whole = whole && character >= kMin[size];  // an overlong form is none
  text.remove_prefix(whole ? size : 1);
  return whole ? static_cast<wchar_t>(character) : L'?';
}

std::string shown(std::string_view text) {
  std::wstring characters;
  while (!text.empty()) characters += next_character(text);
  std::array<char, TAGWRENCH_TEXT_SIZE> out{};
  tagwrench_utf8(characters.c_str(), out.data(), out.size());
  return out.data();
}

std::string first_line(std::string_view text) { return shown(text.substr(0, text.find('\n'))); }

/// What follows "KEY=" in a uevent file.
std::optional<std::string_view> value_of(std::string_view key, std::string_view uevent) {
  while (!uevent.empty()) {
    const std::string_view line = uevent.substr(0, uevent.find('\n'));
    if (line.size() > key.size() && line.starts_with(key) && line[key.size()] == '=')
      return line.substr(key.size() + 1);
    uevent.remove_prefix(std::min(uevent.size(), line.size() + 1));
  }
  return std::nullopt;
}

/// "0003:00001209:00007A6E": bus, vendor, product.
bool parse_id(std::string_view text, HidInterface& device) {
  std::array<std::uint32_t, 3> numbers{};
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    const std::string_view word = text.substr(0, text.find(':'));
    const char* end = word.data() + word.size();
    const auto [stopped, error] = std::from_chars(word.data(), end, numbers[i], 16);
    if (error != std::errc() || stopped != end || numbers[i] > 0xffff) return false;
    text.remove_prefix(std::min(text.size(), word.size() + 1));
  }
  device.vendor = static_cast<std::uint16_t>(numbers[1]);
  device.product = static_cast<std::uint16_t>(numbers[2]);
  return text.empty();
}

/// The kernel's name of a USB device begins with its manufacturer; the device itself, two folders
/// above its interface, has the product alone.
std::optional<std::string> usb_product(const fs::path& device) {
  std::error_code error;
  const fs::path real = fs::canonical(device, error);
  return error ? std::nullopt : attribute(real.parent_path().parent_path() / "product");
}

std::optional<HidInterface> interface(const fs::path& entry) {
  const fs::path device = entry / "device";
  const std::optional<std::string> uevent = attribute(device / "uevent");
  const std::optional<std::string> descriptor = attribute(device / "report_descriptor");
  if (!uevent || !descriptor) return std::nullopt;
  HidInterface found;
  if (!parse_id(value_of("HID_ID", *uevent).value_or(""), found)) return std::nullopt;
  found.path = "/dev/" + entry.filename().string();
  found.serial = shown(value_of("HID_UNIQ", *uevent).value_or(""));
  const std::optional<std::string> product = usb_product(device);
  found.name = product ? first_line(*product) : shown(value_of("HID_NAME", *uevent).value_or(""));
  found.usages = top_level_usages(
      {reinterpret_cast<const std::uint8_t*>(descriptor->data()), descriptor->size()});
  return found;
}

std::uint32_t little_endian(std::span<const std::uint8_t> bytes) {
  std::uint32_t value = 0;
  for (std::size_t i = 0; i < bytes.size(); ++i) value |= std::uint32_t{bytes[i]} << (8 * i);
  return value;
}

}  // namespace

std::vector<HidUsage> top_level_usages(std::span<const std::uint8_t> descriptor) {
  // Prefix byte of a short item without its size bits: tag, type (HID 1.11, 6.2.2.2).
  enum : std::uint8_t { kUsagePage = 0x04, kUsage = 0x08, kCollection = 0xa0, kEnd = 0xc0 };
  constexpr std::uint8_t kLongItem = 0xfe;
  constexpr std::uint8_t kType = 0x0c;  // 0: a main item, before which usages are told
  std::vector<HidUsage> usages;
  std::uint32_t page = 0;
  std::span<const std::uint8_t> usage;  // the first one names the collection
  int depth = 0;
  while (!descriptor.empty()) {
    const std::uint8_t prefix = descriptor[0];
    const bool is_long = prefix == kLongItem;
    if (is_long && descriptor.size() < 2) break;
    const std::size_t head = is_long ? 3 : 1;
    const std::size_t size = is_long ? descriptor[1] : (prefix & 3U) == 3 ? 4 : prefix & 3U;
    if (descriptor.size() < head + size) break;
    const std::span<const std::uint8_t> data = descriptor.subspan(head, size);
    descriptor = descriptor.subspan(head + size);
    if (is_long) continue;
    const auto item = static_cast<std::uint8_t>(prefix & 0xfcU);
    if (item == kUsagePage) page = little_endian(data);
    if (item == kUsage && usage.empty()) usage = data;
    if (item == kCollection && depth++ == 0 && !usage.empty()) {
      const std::uint32_t value = little_endian(usage);
      // Four bytes carry the page, too.
      usages.push_back({static_cast<std::uint16_t>(usage.size() == 4 ? value >> 16 : page),
                        static_cast<std::uint16_t>(value)});
    }
    if (item == kEnd && depth > 0) --depth;
    if ((item & kType) == 0) usage = {};
  }
  return usages;
}

std::vector<HidInterface> hid_interfaces(const fs::path& hidraw_class) {
  std::vector<std::pair<int, fs::path>> entries;
  std::error_code error;
  for (fs::directory_iterator entry(hidraw_class, error), end; !error && entry != end;
       entry.increment(error)) {
    constexpr std::string_view kNode = "hidraw";
    const std::string name = entry->path().filename().string();
    if (!name.starts_with(kNode)) continue;
    int number = 0;
    const char* end_of_name = name.data() + name.size();
    const auto [stopped, bad] = std::from_chars(name.data() + kNode.size(), end_of_name, number);
    if (bad != std::errc() || stopped != end_of_name) continue;
    entries.emplace_back(number, entry->path());
  }
  std::sort(entries.begin(), entries.end());
  std::vector<HidInterface> devices;
  for (const auto& [number, entry] : entries) {
    if (std::optional<HidInterface> device = interface(entry)) devices.push_back(*device);
  }
  return devices;
}

namespace {

constexpr std::uint16_t kGenericDesktop = 0x01;
constexpr std::uint16_t kMultiAxisController = 0x08;
constexpr std::uint16_t kWrenchUsage = 0x10;

std::optional<HidKind> kind_of(const HidInterface& d, const HidUsage& usage) {
  const bool ours = d.vendor == TAGWRENCH_VENDOR_ID && d.product == TAGWRENCH_PRODUCT_ID;
  const bool ours_by_name = usage.usage == kWrenchUsage && d.name.starts_with("tagwrench");
  if (usage.page == TAGWRENCH_USAGE_PAGE && (ours || ours_by_name)) return HidKind::wrench;
  if (usage.page == kGenericDesktop && usage.usage == kMultiAxisController) return HidKind::puck;
  return std::nullopt;
}

std::optional<std::uint16_t> hex4(std::string_view text) {
  std::uint16_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value, 16);
  if (text.size() != 4 || error != std::errc() || end != text.data() + text.size())
    return std::nullopt;
  return value;
}

}  // namespace

std::string HidNode::label() const {
  return fmt::format("{:04x}:{:04x}{}{} ({})", vendor, product, serial.empty() ? "" : " ", serial,
                     path);
}

std::vector<HidNode> hid_nodes(const std::filesystem::path& hidraw_class) {
  std::vector<HidNode> nodes;
  for (const HidInterface& d : hid_interfaces(hidraw_class)) {
    std::optional<HidKind> kind;
    for (const HidUsage& usage : d.usages) {
      if (!kind) kind = kind_of(d, usage);
    }
    if (kind) nodes.push_back({*kind, d.vendor, d.product, d.path, d.serial, d.name});
  }
  std::stable_sort(nodes.begin(), nodes.end(),
                   [](const HidNode& a, const HidNode& b) { return a.kind < b.kind; });
  return nodes;
}

HidChoice::HidChoice(const std::string& text) : text_(text), path_(text.starts_with('/')) {
  const std::string_view view = text_;
  if (view.size() != 9 || view[4] != ':') return;
  const auto vendor = hex4(view.substr(0, 4));
  const auto product = hex4(view.substr(5));
  if (vendor && product) id_ = {*vendor, *product};
}

bool HidChoice::fits(const HidNode& node) const {
  if (text_.empty()) return true;
  if (path_) return node.path == text_;
  if (id_) return node.vendor == id_->first && node.product == id_->second;
  return node.serial == text_;
}

std::optional<HidNode> HidChoice::among(const std::vector<HidNode>& nodes) const {
  std::vector<HidNode> fitting;
  std::copy_if(nodes.begin(), nodes.end(), std::back_inserter(fitting),
               [&](const HidNode& node) { return fits(node); });
  if (fitting.empty()) return std::nullopt;
  // Wrench sensors come first.
  const HidKind kind = fitting.front().kind;
  const auto rivals = std::count_if(fitting.begin(), fitting.end(),
                                    [&](const HidNode& node) { return node.kind == kind; });
  if (rivals == 1) return fitting.front();
  std::string list;
  for (const HidNode& node : fitting) list += (list.empty() ? "" : ", ") + node.label();
  throw ConfigError(
      fmt::format("{} devices fit: {}; name one by its serial or path", fitting.size(), list));
}

std::string HidChoice::words() const {
  const char* what = "wrench sensor or 6-DOF device";
  if (text_.empty()) return what;
  return fmt::format("{} with the {} {}", what, path_ ? "path" : id_ ? "id" : "serial", text_);
}

}  // namespace tagwrench
