#include "host/app/board/board_loop.h"

#include <poll.h>

#include <algorithm>
#include <filesystem>

#include "host/app/input.h"
#include "host/core/config_error.h"
#include "host/core/log.h"
#include "host/core/os/termination.h"

namespace tagwrench {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr Duration kBoardPatience = seconds(6);  ///< an Arduino's boot loader takes two of them
constexpr Duration kSettling = seconds(4);

link::CellInput cell_input(const std::string& name) {
  if (name == "b32") return link::CellInput::b32;
  if (name == "a64") return link::CellInput::a64;
  return link::CellInput::a128;
}

}  // namespace

link::BoardSessionOptions session_options(const BoardSetup& options) {
  link::BoardSessionOptions out = link::new_session();
  std::fill(std::begin(out.configuration.cells), std::end(out.configuration.cells),
            cell_input(options.cell_input));
  out.configuration.cell_rate_sps = static_cast<std::uint8_t>(options.cell_rate);
  out.configuration.adc_mask = options.adc_rate > 0 ? 0x03 : 0;
  out.configuration.adc_rate_hz =
      static_cast<std::uint8_t>(options.adc_rate > 0 ? options.adc_rate : 100);
  return out;
}

BoardLoop::BoardLoop(const std::string& port, const link::BoardSessionOptions& options,
                     const std::string& option)
    : link_(port, options, link::kBaud, option), stop_(termination_fd()) {}

bool BoardLoop::turn(TimePoint until, int other_fd) {
  const auto left =
      std::chrono::ceil<milliseconds>(std::max<Duration>(until - clock_now(), Duration(0)));
  std::array<pollfd, 3> fds{
      {{link_.poll_fd(), POLLIN, 0}, {stop_.get(), POLLIN, 0}, {other_fd, POLLIN, 0}}};
  ::poll(fds.data(), fds.size(), static_cast<int>(std::min<std::int64_t>(left.count(), 60'000)));
  if (fds[1].revents != 0) return false;
  link_.service();
  using Kind = link::BoardEvent::Kind;
  for (link::BoardEvent news; link_.next(news);) {
    const std::string line = text(news);
    if (news.kind == Kind::board_too_old || news.kind == Kind::host_too_old) refusal_ = line;
    if (news.kind == Kind::led_refused) led_refused_ = true;
    const auto fault = static_cast<link::FaultCode>(news.value);
    const bool of_cell = news.kind == Kind::fault && (fault == link::FaultCode::cell_silent ||
                                                      fault == link::FaultCode::cell_stuck);
    if (of_cell && news.other < cell_faults_.size()) cell_faults_[news.other] = fault;
    if (news.kind != Kind::connected && !(of_cell && cell_faults_quiet_)) log_info(line);
  }
  return true;
}

bool BoardLoop::connect() {
  const TimePoint begin = clock_now();
  bool said = false;
  while (session().state() != link::BoardState::ready) {
    if (!turn(begin + kBoardPatience)) return false;
    if (session().state() == link::BoardState::other_version)
      throw ConfigError("{}: a board of another version cannot be used", link_.port());
    const Duration waited = clock_now() - begin;
    if (waited >= kBoardPatience) throw ConfigError(link_.why_no_board());
    if (!said && waited > kBoardPatience / 2) {
      said = true;
      log_info("{}: waiting for the board's answer", link_.port());
    }
  }
  return true;
}

bool BoardLoop::settle() {
  if (!connect()) return false;
  const TimePoint end = clock_now() + kSettling;
  while (clock_now() < end && !(session().clock().report().converged && session().has_status() &&
                                session().has_capabilities()))
    if (!turn(end)) return false;
  return true;
}

std::string cells_path(const BoardSetup& options, const link::BoardSession& session) {
  if (!options.cells_file.empty()) return options.cells_file;
  const std::string id = link::id_text(session.hello().unique_id);
  return id.empty() ? std::string() : link::cell_file_path(id);
}

void check_cells_file(const BoardSetup& options) {
  std::error_code error;
  if (!options.cells_file.empty() && !std::filesystem::exists(options.cells_file, error))
    throw ConfigError("--cells {}: there is no such file", options.cells_file);
}

link::CellCalibrations load_cells(const BoardSetup& options, const link::BoardSession& session) {
  const std::string path = cells_path(options, session);
  if (path.empty()) return {};
  return link::load_cells(path, link::id_text(session.hello().unique_id),
                          options.cells_file.empty() ? link::kMakeAnew : "give another file");
}

}  // namespace tagwrench
