// The emulated board as a process of its own, for tests with the whole program.
#pragma once

#include <sys/stat.h>

#include <optional>
#include <sstream>

#include "tests/cli/bridge.h"

namespace tagwrench::test {

/// Its port exists when the constructor returns.
class BoardProcess {
 public:
  explicit BoardProcess(const TemporaryFolder& folder, std::vector<std::string> arguments = {})
      : port_((folder / "port").string()), orders_path_((folder / "orders").string()) {
    if (::mkfifo(orders_path_.c_str(), 0600) != 0) throw std::runtime_error("mkfifo");
    orders_.reset(::open(orders_path_.c_str(), O_RDWR | O_CLOEXEC));
    arguments.insert(arguments.end(), {"--port", port_});
    process_.emplace(arguments, orders_path_, TAGWRENCH_EMULATED_BOARD);
    if (!process_->wait_for_message("board on")) throw std::runtime_error(process_->err());
  }

  const std::string& port() const { return port_; }
  void order(const std::string& line) {
    const std::string text = line + "\n";
    if (::write(orders_.get(), text.data(), text.size()) < 0) throw std::runtime_error("write");
  }
  /// Waits for a change of the light after those that were waited for before, and returns its
  /// level.
  double next_light() {
    if (!process_->wait_for_lines(++lights_)) throw std::runtime_error("the board has ended");
    std::istringstream lines(process_->out());
    std::string line;
    for (std::ptrdiff_t i = 0; i < lights_; ++i) std::getline(lines, line);
    std::istringstream words(line);
    std::string led;
    double time = 0;
    double level = -1;
    words >> led >> time >> level;
    return level;
  }
  bool light_changed() { return process_->has_lines(lights_ + 1); }

 private:
  std::string port_;
  std::string orders_path_;
  UniqueFd orders_;
  std::optional<Bridge> process_;
  std::ptrdiff_t lights_ = 0;
};

}  // namespace tagwrench::test
