#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "host/calibration/certificate/certificate.h"

namespace tagwrench {
namespace {

constexpr double kAlike = 0.05;
constexpr double kMinPercent = 0.01;
constexpr const char* kSpace = "\u00a0";  // does not break

struct Prefix {
  double factor;
  const char* text;
};

Prefix prefix_for(double value) {
  const double size = std::abs(value);
  if (size >= 0.9995 || size == 0) return {1, ""};
  if (size >= 0.9995e-3) return {1e3, "m"};
  if (size >= 0.9995e-6) return {1e6, "µ"};
  return {1e9, "n"};
}

const char* unit(int axis) { return axis < 3 ? "N" : "N\u00a0m"; }

/// A typographic minus.
std::string with_minus(std::string text) {
  if (!text.empty() && text[0] == '-') text.replace(0, 1, "−");
  return text;
}

/// Decimals that leave so many significant digits, after rounding; `value` is not 0.
int decimals_of(double value, int digits) {
  const std::string text = fmt::format("{:.{}e}", value, digits - 1);
  return std::max(0, digits - 1 - std::stoi(text.substr(text.find('e') + 1)));
}

/// No minus before a zero.
std::string fixed(double value, int decimals) {
  const std::string text = fmt::format("{:.{}f}", value, decimals);
  return text.find_first_of("123456789") == std::string::npos && text[0] == '-' ? text.substr(1)
                                                                                : with_minus(text);
}

/// In decimal notation where that is short.
std::string rounded(double value, int digits) {
  if (value == 0) return "0";
  std::string text = fmt::format("{:.{}e}", value, digits - 1);
  const int decade = std::stoi(text.substr(text.find('e') + 1));  // after rounding
  if (decade < -3 || decade > 4) return text;
  return fmt::format("{:.{}f}", value, std::max(0, digits - 1 - decade));
}

}  // namespace

std::string number_text(double value) {
  return std::isfinite(value) ? with_minus(rounded(value, 3)) : "–";
}

std::string percent_text(double value) {
  if (std::abs(value) < kMinPercent) return "<0.01\u00a0%";
  return std::isfinite(value) ? with_minus(rounded(value, 2)) + kSpace + "%" : "–";
}

std::string load_text(double value, int axis) {
  if (!std::isfinite(value)) return "–";
  const Prefix prefix = prefix_for(value);
  return fmt::format("{}{}{}{}", number_text(value * prefix.factor), kSpace, prefix.text,
                     unit(axis));
}

std::string range_text(double low, double high, int axis) {
  const double largest = std::max(std::abs(low), std::abs(high));
  if (!std::isfinite(largest)) return "–";
  const Prefix prefix = prefix_for(largest);
  if (low < 0 && high > 0 && std::abs(low + high) < kAlike * largest)
    return fmt::format("±{}{}{}{}", number_text(std::min(-low, high) * prefix.factor), kSpace,
                       prefix.text, unit(axis));
  const int decimals = decimals_of(largest * prefix.factor, 3);
  return fmt::format("{}{}to{}{}{}{}{}", fixed(low * prefix.factor, decimals), kSpace, kSpace,
                     fixed(high * prefix.factor, decimals), kSpace, prefix.text, unit(axis));
}

}  // namespace tagwrench
