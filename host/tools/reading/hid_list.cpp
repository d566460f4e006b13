#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <iterator>
#include <map>
#include <system_error>

#include "host/core/config_error.h"
#include "host/core/parse.h"
#include "host/tools/reading/reader.h"

namespace tagwrench {
namespace {

namespace fs = std::filesystem;

constexpr std::uint16_t kGenericDesktop = 0x01;
constexpr std::uint16_t kMultiAxisController = 0x08;
constexpr std::uint16_t kWrenchUsage = 0x10;

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

/// Fit for a terminal: '?' for control characters and for bytes that are no UTF-8.
std::string shown(std::string_view text) {
  std::string out;
  while (!text.empty() && out.size() + 4 < TAGWRENCH_TEXT_SIZE) {
    const std::size_t length = utf8_length(text);
    const auto first = static_cast<unsigned char>(text[0]);
    // Of two bytes: U+0080 to U+009F.
    const bool control =
        length == 1 ? first < ' ' || first == 0x7f
                    : text.starts_with('\xc2') && static_cast<unsigned char>(text[1]) < 0xa0;
    out += length == 0 || control ? "?" : text.substr(0, length);
    text.remove_prefix(std::max<std::size_t>(1, length));
  }
  return out;
}

/// What follows "KEY=" in a uevent file.
std::optional<std::string_view> value_of(std::string_view key, std::string_view uevent) {
  for (const std::string_view line : split(uevent, '\n'))
    if (line.size() > key.size() && line.starts_with(key) && line[key.size()] == '=')
      return line.substr(key.size() + 1);
  return std::nullopt;
}

/// "0003:00001209:00007A6E": bus, vendor, product.
std::optional<std::array<std::uint16_t, 2>> vendor_and_product(std::string_view text) {
  const std::vector<std::string_view> words = split(text, ':');
  if (words.size() != 3 || !parse_whole<std::uint16_t>(words[0], 16)) return std::nullopt;
  const auto vendor = parse_whole<std::uint16_t>(words[1], 16);
  const auto product = parse_whole<std::uint16_t>(words[2], 16);
  if (!vendor || !product) return std::nullopt;
  return std::array{*vendor, *product};
}

/// The kernel's name of a USB device begins with its manufacturer; the device itself, two folders
/// above its interface, has the product alone.
std::optional<std::string> usb_product(const fs::path& device) {
  std::error_code error;
  const fs::path real = fs::canonical(device, error);
  return error ? std::nullopt : attribute(real.parent_path().parent_path() / "product");
}

std::optional<HidKind> kind_of(const HidNode& d, const HidUsage& usage) {
  const bool ours = d.vendor == TAGWRENCH_VENDOR_ID && d.product == TAGWRENCH_PRODUCT_ID;
  const bool ours_by_name = usage.usage == kWrenchUsage && d.name.starts_with("tagwrench");
  if (usage.page == TAGWRENCH_USAGE_PAGE && (ours || ours_by_name)) return HidKind::wrench;
  if (usage.page == kGenericDesktop && usage.usage == kMultiAxisController) return HidKind::puck;
  return std::nullopt;
}

std::optional<HidNode> node_of(const fs::path& entry) {
  const fs::path device = entry / "device";
  const std::optional<std::string> uevent = attribute(device / "uevent");
  const std::optional<std::string> descriptor = attribute(device / "report_descriptor");
  if (!uevent || !descriptor) return std::nullopt;
  const auto id = vendor_and_product(value_of("HID_ID", *uevent).value_or(""));
  if (!id) return std::nullopt;
  const std::optional<std::string> product = usb_product(device);
  HidNode node{.vendor = (*id)[0],
               .product = (*id)[1],
               .path = "/dev/" + entry.filename().string(),
               .serial = shown(value_of("HID_UNIQ", *uevent).value_or("")),
               .name = product ? shown(product->substr(0, product->find('\n')))
                               : shown(value_of("HID_NAME", *uevent).value_or(""))};
  for (const HidUsage& usage : top_level_usages(
           {reinterpret_cast<const std::uint8_t*>(descriptor->data()), descriptor->size()})) {
    if (const std::optional<HidKind> kind = kind_of(node, usage)) {
      node.kind = *kind;
      return node;
    }
  }
  return std::nullopt;
}

std::uint32_t little_endian(std::span<const std::uint8_t> bytes) {
  std::uint32_t value = 0;
  for (std::size_t i = 0; i < bytes.size(); ++i) value |= std::uint32_t{bytes[i]} << (8 * i);
  return value;
}

constexpr std::uint8_t kTranslationId = 1;  // and rotation, where combined
constexpr std::uint8_t kRotationId = 2;
constexpr std::uint8_t kButtonsId = 3;
constexpr std::size_t kThreeAxes = 7;  // bytes, report id included
constexpr std::size_t kSixAxes = 13;

constexpr PuckModel kModels[] = {
    {0x046d, 0xc621, "any", "Spaceball 5000"},
    {0x046d, 0xc623, "split", "SpaceTraveler"},
    {0x046d, 0xc625, "split", "SpacePilot"},
    {0x046d, 0xc626, "split", "SpaceNavigator"},
    {0x046d, 0xc627, "split", "SpaceExplorer"},
    {0x046d, 0xc628, "split", "SpaceNavigator for Notebooks"},
    {0x046d, 0xc629, "split", "SpacePilot Pro"},
    {0x046d, 0xc62b, "split", "SpaceMouse Pro"},
    {0x256f, 0xc62e, "combined", "SpaceMouse Wireless (cable)"},
    {0x256f, 0xc62f, "combined", "SpaceMouse Wireless (receiver)"},
    {0x256f, 0xc631, "combined", "SpaceMouse Pro Wireless (cable)"},
    {0x256f, 0xc632, "combined", "SpaceMouse Pro Wireless (receiver)"},
    {0x256f, 0xc633, "combined", "SpaceMouse Enterprise"},
    {0x256f, 0xc635, "split", "SpaceMouse Compact"},
    {0x256f, 0xc636, "any", "SpaceMouse Module"},
    {0x256f, 0xc638, "combined", "SpaceMouse Pro Wireless (Bluetooth)"},
    {0x256f, 0xc63a, "combined", "SpaceMouse Wireless (Bluetooth)"},
    {0x256f, 0xc652, "combined", "3Dconnexion universal receiver"},
};

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

std::string HidNode::label() const {
  return fmt::format("{:04x}:{:04x}{}{} ({})", vendor, product, serial.empty() ? "" : " ", serial,
                     path);
}

std::vector<HidNode> hid_nodes(const fs::path& hidraw_class) {
  std::map<std::pair<HidKind, int>, HidNode> in_order;
  std::error_code error;
  for (fs::directory_iterator entry(hidraw_class, error), end; !error && entry != end;
       entry.increment(error)) {
    constexpr std::string_view kNode = "hidraw";
    const std::string name = entry->path().filename().string();
    if (!name.starts_with(kNode)) continue;
    const auto number = parse_whole<int>(std::string_view(name).substr(kNode.size()));
    const std::optional<HidNode> node = number ? node_of(entry->path()) : std::nullopt;
    if (node) in_order.emplace(std::pair(node->kind, *number), *node);
  }
  std::vector<HidNode> nodes;
  for (auto& [order, node] : in_order) nodes.push_back(std::move(node));
  return nodes;
}

HidChoice::HidChoice(const std::string& text) : text_(text), path_(text.starts_with('/')) {
  const std::string_view view = text_;
  if (view.size() != 9 || view[4] != ':') return;
  const auto vendor = parse_whole<std::uint16_t>(view.substr(0, 4), 16);
  const auto product = parse_whole<std::uint16_t>(view.substr(5), 16);
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
  throw ConfigError("{} devices fit: {}; name one by its serial or path", fitting.size(), list);
}

std::string HidChoice::words() const {
  const char* what = "wrench sensor or 6-DOF device";
  if (text_.empty()) return what;
  return fmt::format("{} with the {} {}", what, path_ ? "path" : id_ ? "id" : "serial", text_);
}

const PuckModel* puck_model(std::uint16_t vendor, std::uint16_t product) noexcept {
  for (const PuckModel& model : kModels)
    if (model.vendor == vendor && model.product == product) return &model;
  return nullptr;
}

PuckState::Change PuckState::take(std::span<const std::uint8_t> report) noexcept {
  if (report.empty()) return Change::stranger;
  const std::uint8_t id = report[0];
  if (id == kTranslationId || id == kRotationId) {
    if (report.size() < kThreeAxes) return Change::stranger;
    const bool combined = id == kTranslationId && report.size() >= kSixAxes;
    const std::size_t first = id == kRotationId ? 3 : 0;
    for (std::size_t i = 0; i < (combined ? 6 : 3); ++i)
      counts[first + i] = static_cast<std::int16_t>(little_endian(report.subspan(1 + 2 * i, 2)));
    return Change::motion;
  }
  if (id == kButtonsId) {
    if (report.size() < 2) return Change::stranger;
    buttons =
        little_endian(report.subspan(1, std::min<std::size_t>(report.size() - 1, sizeof buttons)));
    return Change::buttons;
  }
  return Change::none;
}

}  // namespace tagwrench
