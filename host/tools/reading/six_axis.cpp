#include "host/tools/reading/six_axis.h"

#include <algorithm>

namespace tagwrench {
namespace {

constexpr std::uint8_t kTranslationId = 1;  // and rotation, where combined
constexpr std::uint8_t kRotationId = 2;
constexpr std::uint8_t kButtonsId = 3;
constexpr std::size_t kThreeAxes = 7;  // bytes, report id included
constexpr std::size_t kSixAxes = 13;

constexpr auto kUnknown = PuckLayout::unknown;
constexpr auto kCombined = PuckLayout::combined;
constexpr auto kSplit = PuckLayout::split;

constexpr PuckModel kModels[] = {
    {0x046d, 0xc621, kUnknown, "Spaceball 5000"},
    {0x046d, 0xc623, kSplit, "SpaceTraveler"},
    {0x046d, 0xc625, kSplit, "SpacePilot"},
    {0x046d, 0xc626, kSplit, "SpaceNavigator"},
    {0x046d, 0xc627, kSplit, "SpaceExplorer"},
    {0x046d, 0xc628, kSplit, "SpaceNavigator for Notebooks"},
    {0x046d, 0xc629, kSplit, "SpacePilot Pro"},
    {0x046d, 0xc62b, kSplit, "SpaceMouse Pro"},
    {0x256f, 0xc62e, kCombined, "SpaceMouse Wireless (cable)"},
    {0x256f, 0xc62f, kCombined, "SpaceMouse Wireless (receiver)"},
    {0x256f, 0xc631, kCombined, "SpaceMouse Pro Wireless (cable)"},
    {0x256f, 0xc632, kCombined, "SpaceMouse Pro Wireless (receiver)"},
    {0x256f, 0xc633, kCombined, "SpaceMouse Enterprise"},
    {0x256f, 0xc635, kSplit, "SpaceMouse Compact"},
    {0x256f, 0xc636, kUnknown, "SpaceMouse Module"},
    {0x256f, 0xc638, kCombined, "SpaceMouse Pro Wireless (Bluetooth)"},
    {0x256f, 0xc63a, kCombined, "SpaceMouse Wireless (Bluetooth)"},
    {0x256f, 0xc652, kCombined, "3Dconnexion universal receiver"},
};

}  // namespace

const PuckModel* puck_model(std::uint16_t vendor, std::uint16_t product) noexcept {
  const auto* found = std::find_if(std::begin(kModels), std::end(kModels), [&](const PuckModel& m) {
    return m.vendor == vendor && m.product == product;
  });
  return found == std::end(kModels) ? nullptr : found;
}

void PuckDecoder::take_axes(std::span<const std::uint8_t> bytes, std::size_t first,
                            std::size_t count) noexcept {
  for (std::size_t i = 0; i < count; ++i) {
    const auto word = static_cast<std::uint16_t>(bytes[2 * i] | bytes[2 * i + 1] << 8);
    state_.counts[first + i] = static_cast<std::int16_t>(word);
  }
}

PuckDecoder::Change PuckDecoder::take(std::span<const std::uint8_t> report) noexcept {
  if (report.empty()) return Change::stranger;
  const std::uint8_t id = report[0];
  if (id == kTranslationId || id == kRotationId) {
    if (report.size() < kThreeAxes) return Change::stranger;
    const bool combined = id == kTranslationId && report.size() >= kSixAxes;
    layout_ = combined ? PuckLayout::combined : PuckLayout::split;
    take_axes(report.subspan(1), id == kRotationId ? 3 : 0, combined ? 6 : 3);
    return Change::motion;
  }
  if (id == kButtonsId) {
    if (report.size() < 2) return Change::stranger;
    state_.buttons = 0;
    const std::size_t bytes = std::min<std::size_t>(report.size() - 1, sizeof state_.buttons);
    for (std::size_t i = 0; i < bytes; ++i) {
      state_.buttons |= std::uint32_t{report[1 + i]} << (8 * i);
    }
    return Change::buttons;
  }
  return Change::none;
}

}  // namespace tagwrench
