// What a page is still to be sent, while it is busy with what it was sent before: bounded, whatever
// it does.
#pragma once

#include <cstdint>
#include <deque>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace tagwrench {

class Outbox {
 public:
  static constexpr std::size_t kMaxKept = 64;
  static constexpr std::size_t kMaxTypes = 16;

  /// Goes out, in its turn. False: 64 wait already.
  bool keep(std::shared_ptr<const std::string> text);
  /// Takes the place of the one of its type that waits.
  void replace(std::string_view type, std::shared_ptr<const std::string> text);
  void replace_picture(std::shared_ptr<const std::vector<std::uint8_t>> picture);

  /// Those that are kept in their order, then the latest of each type; null: there is none.
  std::shared_ptr<const std::string> next_text();
  std::shared_ptr<const std::vector<std::uint8_t>> next_picture();

 private:
  std::deque<std::shared_ptr<const std::string>> kept_;
  std::deque<std::pair<std::string, std::shared_ptr<const std::string>>> latest_;
  std::shared_ptr<const std::vector<std::uint8_t>> picture_;
};

}  // namespace tagwrench
