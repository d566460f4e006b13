// A small HID report descriptor parser, written from the HID specification 1.11 (section 6.2.2) and
// nothing else, so that it can say whether the shipped descriptor and reports mean what they
// should. It knows no usage of ours.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <optional>
#include <span>
#include <stdexcept>
#include <utility>
#include <vector>

namespace tagwrench::test {

/// Powers of metre, kilogram and second (and radian, for a rotation system).
struct Dimension {
  int length = 0;
  int mass = 0;
  int time = 0;
  bool rotation = false;
  bool operator==(const Dimension&) const = default;
};

inline constexpr Dimension kNewton{1, 1, -2, false};
inline constexpr Dimension kNewtonMetre{2, 1, -2, false};
inline constexpr Dimension kSecond{0, 0, 1, false};
inline constexpr Dimension kPlainNumber{};

enum class HidReportType { input, output, feature };

struct HidField {
  HidReportType type{};
  std::uint32_t application = 0;  ///< usage page in the upper 16 bits, usage in the lower
  std::uint32_t usage = 0;
  std::uint8_t report_id = 0;
  unsigned offset_bits = 0;  ///< from the start of the report; the report id is its first byte
  unsigned size_bits = 0;
  std::int64_t logical_min = 0;
  std::int64_t logical_max = 0;
  std::int64_t physical_min = 0;
  std::int64_t physical_max = 0;
  std::uint32_t unit = 0;
  int exponent = 0;
  bool constant = false;
  bool relative = false;

  Dimension dimension() const {
    // Section 6.2.2.7: nibbles system, length, mass, time; powers are signed nibbles. System 1 is
    // SI linear, 2 SI rotation.
    const auto power = [this](int nibble) { return signed_nibble(unit >> (4 * nibble)); };
    const unsigned system = unit & 0xf;
    if (system == 0) return {};
    if (system > 2) throw std::runtime_error("not an SI unit system");
    return {power(1), power(2), power(3), system == 2};
  }

  /// The raw field of a report.
  std::int64_t raw(std::span<const std::uint8_t> report) const {
    if (offset_bits + size_bits > report.size() * 8) throw std::runtime_error("report too short");
    std::uint64_t value = 0;
    for (unsigned i = 0; i < size_bits; ++i) {
      const unsigned bit = offset_bits + i;
      value |= std::uint64_t{(report[bit / 8] >> (bit % 8)) & 1u} << i;
    }
    const bool negative = logical_min < 0 && (value >> (size_bits - 1) & 1) != 0;
    const auto number = static_cast<std::int64_t>(value);
    return negative ? number - (std::int64_t{1} << size_bits) : number;
  }

  /// The field in SI units: section 6.2.2.7's resolution formula, then centimetres and grams to
  /// metres and kilograms.
  double si(std::span<const std::uint8_t> report) const {
    const bool no_physical = physical_min == 0 && physical_max == 0;
    const auto low = static_cast<double>(no_physical ? logical_min : physical_min);
    const auto high = static_cast<double>(no_physical ? logical_max : physical_max);
    const double per_count = (high - low) / static_cast<double>(logical_max - logical_min);
    const double value = low + per_count * static_cast<double>(raw(report) - logical_min);
    const Dimension d = dimension();
    const int length_exponent = d.rotation ? 0 : -2 * d.length;
    return value * std::pow(10.0, exponent + length_exponent - 3 * d.mass);
  }

  static int signed_nibble(std::uint32_t bits) {
    const int nibble = static_cast<int>(bits & 0xf);
    return nibble >= 8 ? nibble - 16 : nibble;
  }
};

struct HidDescriptor {
  std::vector<HidField> fields;
  unsigned open_collections = 0;

  /// All fields of a quantity, in the order of the descriptor.
  std::vector<HidField> with(Dimension dimension, HidReportType type = HidReportType::input) const {
    std::vector<HidField> found;
    for (const HidField& field : fields) {
      if (!field.constant && field.type == type && field.dimension() == dimension) {
        found.push_back(field);
      }
    }
    return found;
  }

  std::optional<HidField> find(std::uint32_t usage) const {
    for (const HidField& field : fields) {
      if (!field.constant && field.usage == usage) return field;
    }
    return std::nullopt;
  }

  /// Bytes of a report, its id included.
  std::size_t report_size(HidReportType type, std::uint8_t id) const {
    unsigned bits = 0;
    for (const HidField& field : fields) {
      if (field.type == type && field.report_id == id) {
        bits = std::max(bits, field.offset_bits + field.size_bits);
      }
    }
    return (bits + 7) / 8;
  }
};

class HidDescriptorParser {
 public:
  explicit HidDescriptorParser(std::span<const std::uint8_t> bytes) {
    std::size_t at = 0;
    while (at < bytes.size()) {
      const std::uint8_t prefix = bytes[at++];
      if (prefix == 0xfe) throw std::runtime_error("long item");  // 6.2.2.3: none are defined
      const std::size_t size = (prefix & 3) == 3 ? 4 : prefix & 3;
      if (bytes.size() - at < size) throw std::runtime_error("descriptor ends within an item");
      std::uint32_t data = 0;
      for (std::size_t i = 0; i < size; ++i) data |= std::uint32_t{bytes[at + i]} << (8 * i);
      at += size;
      item(prefix >> 2 & 3, prefix >> 4, data, size);
    }
  }

  HidDescriptor take() { return std::move(result_); }

 private:
  static std::int64_t signed_value(std::uint32_t data, std::size_t size) {
    if (size == 0 || size == 4) return static_cast<std::int32_t>(data);
    const std::int64_t sign = std::int64_t{1} << (8 * size - 1);
    return (std::int64_t{data} ^ sign) - sign;
  }

  void item(int type, int tag, std::uint32_t data, std::size_t size) {
    if (type == 0) main_item(tag, data);
    if (type == 1) global_item(tag, data, size);
    if (type == 2) local_item(tag, data, size);
    if (type == 3) throw std::runtime_error("reserved item type");
  }

  void main_item(int tag, std::uint32_t data) {
    switch (tag) {
      case 0x8: add_fields(HidReportType::input, data); break;
      case 0x9: add_fields(HidReportType::output, data); break;
      case 0xb: add_fields(HidReportType::feature, data); break;
      case 0xa:
        if (data == 1 && !usages_.empty()) application_ = usages_.front();
        ++result_.open_collections;
        break;
      case 0xc:
        if (result_.open_collections == 0) throw std::runtime_error("collection closed twice");
        --result_.open_collections;
        break;
      default: throw std::runtime_error("reserved main item");
    }
    usages_.clear();  // local items end with the main item
    usage_min_.reset();
  }

  void global_item(int tag, std::uint32_t data, std::size_t size) {
    switch (tag) {
      case 0x0: page_ = data; break;
      case 0x1: now_.logical_min = signed_value(data, size); break;
      case 0x2: now_.logical_max = signed_value(data, size); break;
      case 0x3: now_.physical_min = signed_value(data, size); break;
      case 0x4: now_.physical_max = signed_value(data, size); break;
      case 0x5: now_.exponent = HidField::signed_nibble(data); break;
      case 0x6: now_.unit = data; break;
      case 0x7: now_.size_bits = data; break;
      case 0x8: now_.report_id = static_cast<std::uint8_t>(data); break;
      case 0x9: count_ = data; break;
      default: throw std::runtime_error("push and pop are not supported");
    }
  }

  void local_item(int tag, std::uint32_t data, std::size_t size) {
    const std::uint32_t usage = size == 4 ? data : page_ << 16 | data;
    if (tag == 0x0) usages_.push_back(usage);
    if (tag == 0x1) usage_min_ = usage;
    if (tag == 0x2) {
      if (!usage_min_) throw std::runtime_error("usage maximum without minimum");
      for (std::uint32_t u = *usage_min_; u <= usage; ++u) usages_.push_back(u);
    }
  }

  void add_fields(HidReportType type, std::uint32_t flags) {
    for (std::uint32_t i = 0; i < count_; ++i) {
      HidField field = now_;
      field.type = type;
      field.application = application_;
      field.constant = (flags & 1) != 0;
      field.relative = (flags & 4) != 0;
      if (!field.constant && (flags & 2) == 0) throw std::runtime_error("array fields");
      // 6.2.2.8: the last usage goes for all that are left
      if (!usages_.empty()) field.usage = usages_[std::min<std::size_t>(i, usages_.size() - 1)];
      unsigned& used_bits = used_bits_[static_cast<std::size_t>(type)][field.report_id];
      field.offset_bits = used_bits + (field.report_id != 0 ? 8 : 0);
      used_bits += field.size_bits;
      result_.fields.push_back(field);
    }
  }

  HidDescriptor result_;
  HidField now_;
  std::uint32_t page_ = 0;
  std::uint32_t count_ = 0;
  std::uint32_t application_ = 0;
  std::vector<std::uint32_t> usages_;
  std::optional<std::uint32_t> usage_min_;
  std::array<std::array<unsigned, 256>, 3> used_bits_{};
};

inline HidDescriptor parse_hid(std::span<const std::uint8_t> bytes) {
  return HidDescriptorParser(bytes).take();
}

}  // namespace tagwrench::test
