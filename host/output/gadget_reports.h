// What a gadget's other computer is still owed: the newest report of each kind, never one before.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "host/output/gadget_tree.h"

namespace tagwrench {

class GadgetReports {
 public:
  static constexpr std::size_t kMax = 64;

  /// All at rest, nothing owed.
  explicit GadgetReports(GadgetFace face) noexcept;

  /// Reports one behind the other, report id first, each of its full length. Each replaces the one
  /// of its kind; buttons as they were are not owed. What is no report of this face is dropped.
  void put(std::span<const std::uint8_t> reports) noexcept;

  /// All at rest, and owed.
  void rest() noexcept;
  /// A computer that has seen nothing yet is owed all.
  void renew() noexcept;

  bool owed() const noexcept;
  /// The one to write next: buttons before motion, which is owed nearly always. A motion that has
  /// been taken already is dithered (see dithered()). Valid until the next call.
  std::span<const std::uint8_t> next() noexcept;
  /// The last next() is written.
  void taken() noexcept;

 private:
  struct Kind {
    std::uint8_t id = 0;
    std::size_t size = 0;
    bool stream = false;  ///< motion and samples: every one counts, even if it repeats the last
    bool axes = false;
    bool owed = false;
    std::array<std::uint8_t, kMax> newest{};
    std::array<std::uint8_t, kMax> last{};  ///< taken

    std::span<const std::uint8_t> bytes() const { return {newest.data(), size}; }
  };
  void put_one(Kind& kind, std::span<const std::uint8_t> report) noexcept;
  Kind* first_owed() noexcept;

  GadgetFace face_;
  std::array<Kind, 2> kinds_;
  std::size_t count_ = 0;
  std::array<std::uint8_t, kMax> out_{};
};

}  // namespace tagwrench
