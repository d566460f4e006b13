#include "host/client/hid_list.h"

#include <fmt/format.h>
#include <hidapi.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <string_view>

#include "host/client/hid_text.h"
#include "host/client/six_axis.h"
#include "host/client/tagwrench_hid.h"
#include "host/config_error.h"

namespace tagwrench {
namespace {

constexpr std::uint16_t kGenericDesktop = 0x01;
constexpr std::uint16_t kMultiAxisController = 0x08;
constexpr std::uint16_t kWrenchUsage = 0x10;

std::string utf8(const wchar_t* text) {
  std::array<char, TAGWRENCH_TEXT_SIZE> out{};
  tagwrench_utf8(text, out.data(), out.size());
  return out.data();
}

std::optional<HidKind> kind_of(const hid_device_info& d, const std::string& name) {
  const bool ours = d.vendor_id == TAGWRENCH_VENDOR_ID && d.product_id == TAGWRENCH_PRODUCT_ID;
  const bool ours_by_name = d.usage == kWrenchUsage && name.starts_with("tagwrench");
  if (d.usage_page == TAGWRENCH_USAGE_PAGE && (ours || ours_by_name)) return HidKind::wrench;
  if (d.usage_page == kGenericDesktop && d.usage == kMultiAxisController) return HidKind::puck;
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

std::vector<HidNode> hid_nodes() {
  std::vector<HidNode> nodes;
  hid_device_info* all = hid_enumerate(0, 0);
  for (const hid_device_info* d = all; d != nullptr; d = d->next) {
    if (d->path == nullptr) continue;  // it went while it was looked at
    const std::string product = utf8(d->product_string);
    const std::optional<HidKind> kind = kind_of(*d, product);
    // A device with several collections is listed several times.
    const bool known = std::any_of(nodes.begin(), nodes.end(),
                                   [&](const HidNode& node) { return node.path == d->path; });
    if (!kind || known) continue;
    nodes.push_back({*kind, d->vendor_id, d->product_id, d->path, utf8(d->serial_number), product});
  }
  hid_free_enumeration(all);
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
