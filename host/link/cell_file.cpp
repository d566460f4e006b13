#include "host/link/cell_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "host/config_error.h"
#include "host/os/unique_fd.h"

namespace tagwrench::link {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr const char* kFormat = "tagwrench-cells-1";
constexpr std::uintmax_t kMostBytes = 1 << 20;

[[noreturn]] void refuse(const std::string& path, const std::string& why) {
  throw ConfigError(
      fmt::format("{}: {}; remove it and run `tagwrench board calibrate-cell`", path, why));
}

double number(const std::string& path, const json& cell, const char* key) {
  const auto found = cell.find(key);
  if (found == cell.end() || !found->is_number())
    refuse(path, fmt::format("\"{}\" is missing or no number", key));
  const double value = found->get<double>();
  if (!std::isfinite(value)) refuse(path, fmt::format("\"{}\" is not finite", key));
  return value;
}

void read_cell(const std::string& path, const json& cell, CellCalibrations& out) {
  if (!cell.is_object()) refuse(path, "\"cells\" holds something that is no cell");
  const double channel = number(path, cell, "channel");
  if (channel < 0 || channel >= kMostChannels || channel != std::floor(channel))
    refuse(path, fmt::format("channel {} does not exist", channel));
  CellCalibration& to = out[static_cast<std::size_t>(channel)];
  to.newtons_per_count = number(path, cell, "newtons_per_count");
  to.newtons_per_count_sigma = number(path, cell, "newtons_per_count_sigma");
  to.zero_counts = number(path, cell, "zero_counts");
  to.zero_sigma_counts = number(path, cell, "zero_sigma_counts");
  to.noise_counts = number(path, cell, "noise_counts");
  if (cell.contains("zero_scale_covariance_n"))
    to.zero_scale_covariance_n = number(path, cell, "zero_scale_covariance_n");
  to.residual_n = number(path, cell, "residual_n");
  if (to.newtons_per_count == 0) refuse(path, "\"newtons_per_count\" is 0");
  if (to.newtons_per_count_sigma < 0 || to.zero_sigma_counts < 0 || to.noise_counts < 0)
    refuse(path, "a standard deviation is negative");
  to.calibrated = true;
}

[[noreturn]] void not_written(const std::string& path, int error) {
  throw ConfigError(fmt::format("{}: cannot be written: {}; give another file with --cells", path,
                                std::strerror(error)));
}

void write_whole(const std::string& path, const std::string& text) {
  const std::string beside = fmt::format("{}.{}", path, ::getpid());
  UniqueFd fd(::open(beside.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0644));
  if (!fd) not_written(path, errno);
  errno = ENOSPC;
  const bool written =
      ::write(fd.get(), text.data(), text.size()) == static_cast<ssize_t>(text.size()) &&
      ::fsync(fd.get()) == 0 && ::rename(beside.c_str(), path.c_str()) == 0;
  if (written) return;
  const int error = errno;
  ::unlink(beside.c_str());
  not_written(path, error);
}

}  // namespace

std::string id_text(const UniqueId& id) {
  std::string out;
  for (std::size_t i = 0; i < id.count && i < kIdBytes; ++i)
    out += fmt::format("{:02x}", id.bytes[i]);
  return out;
}

std::string cell_file_path(const std::string& board_id) {
  const char* config = std::getenv("XDG_CONFIG_HOME");
  const char* home = std::getenv("HOME");
  fs::path folder;
  if (config != nullptr && *config == '/') {
    folder = config;
  } else if (home != nullptr && *home == '/') {
    folder = fs::path(home) / ".config";
  } else {
    throw ConfigError(
        "board: neither XDG_CONFIG_HOME nor HOME says where calibrations are kept; give --cells "
        "FILE");
  }
  return (folder / "tagwrench" / fmt::format("board-{}.json", board_id)).string();
}

CellCalibrations load_cells(const std::string& path, const std::string& board_id) {
  CellCalibrations out;
  std::error_code error;
  if (!fs::exists(path, error)) return out;
  if (!fs::is_regular_file(path, error) || fs::file_size(path, error) > kMostBytes)
    refuse(path, "is no calibration of load cells");
  std::ifstream in(path);
  std::ostringstream content;
  if (!in || !(content << in.rdbuf())) refuse(path, "cannot be read, or is empty");
  const json root = json::parse(content.str(), nullptr, /*allow_exceptions=*/false);
  if (!root.is_object() || root.value("format", json()) != kFormat)
    refuse(path, fmt::format("is not of the format \"{}\"", kFormat));
  const json owner = root.value("board", json());
  if (!board_id.empty() && owner.is_string() && owner != "" && owner != board_id) {
    throw ConfigError(fmt::format(
        "{}: belongs to the board {}, this one is {}; calibrate this board's cells, or give "
        "another --cells",
        path, owner.get<std::string>(), board_id));
  }
  const json cells = root.value("cells", json());
  if (!cells.is_array()) refuse(path, "\"cells\" is missing");
  for (const json& cell : cells) read_cell(path, cell, out);
  return out;
}

void save_cells(const std::string& path, const std::string& board_id,
                const CellCalibrations& cells) {
  json list = json::array();
  for (std::size_t i = 0; i < cells.size(); ++i) {
    const CellCalibration& cell = cells[i];
    if (!cell.calibrated) continue;
    list.push_back({{"channel", i},
                    {"newtons_per_count", cell.newtons_per_count},
                    {"newtons_per_count_sigma", cell.newtons_per_count_sigma},
                    {"zero_counts", cell.zero_counts},
                    {"zero_sigma_counts", cell.zero_sigma_counts},
                    {"zero_scale_covariance_n", cell.zero_scale_covariance_n},
                    {"noise_counts", cell.noise_counts},
                    {"residual_n", cell.residual_n}});
  }
  std::error_code error;
  const fs::path folder = fs::path(path).parent_path();
  if (!folder.empty()) fs::create_directories(folder, error);
  write_whole(path,
              json({{"format", kFormat}, {"board", board_id}, {"cells", list}}).dump(2) + "\n");
}

}  // namespace tagwrench::link
