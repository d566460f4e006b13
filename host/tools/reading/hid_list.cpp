#include "host/tools/reading/hid_list.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <string_view>

#include "host/core/config_error.h"
#include "host/tools/reading/hid_sysfs.h"
#include "host/tools/reading/six_axis.h"
#include "host/tools/reading/tagwrench_hid.h"

namespace tagwrench {
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
