#include "host/calibration/certificate/render.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <memory>
#include <stdexcept>

#include "host/calibration/certificate/html.h"
#include "host/calibration/certificate/plots.h"
#include "host/core/os/unique_fd.h"

namespace tagwrench {
namespace {

constexpr std::chrono::seconds kPatience{120};
constexpr double kPageWidth_mm = 186;
constexpr double kScatterShare = 0.62;  // of the page's width
constexpr double kPx_per_mm = 96 / 25.4;

constexpr std::array<PageRoom, 4> kRooms{{
    {68, 98, 8, 300, 160},
    {62, 84, 8, 300, 160},
    {54, 66, 6, 200, 100},
    {42, 42, 4, 110, 55},
}};

PlotSize plot_size(double width_mm, double height_mm) {
  return {static_cast<int>(std::lround(width_mm * kPx_per_mm)),
          static_cast<int>(std::lround(height_mm * kPx_per_mm))};
}

/// Objects of type Page; weasyprint leaves them uncompressed.
int pages_of(const std::string& pdf) {
  constexpr std::string_view kPage = "/Type /Page";
  int count = 0;
  for (std::size_t at = pdf.find(kPage); at != std::string::npos; at = pdf.find(kPage, at + 1)) {
    if (at + kPage.size() < pdf.size() && pdf[at + kPage.size()] != 's') ++count;
  }
  if (count == 0) throw std::runtime_error("weasyprint failed: its PDF has no page");
  return count;
}

}  // namespace

RenderedCertificate render_certificate(const Certificate& certificate) {
  RenderedCertificate result;
  result.json = certificate_json(certificate);
  for (const PageRoom& room : kRooms) {
    const std::string scatter = scatter_svg(
        certificate.analysis, plot_size(kScatterShare * kPageWidth_mm - 4, room.scatter_mm));
    const std::string traces =
        traces_svg(certificate.analysis, plot_size(kPageWidth_mm, room.traces_mm));
    result.html = certificate_html(certificate, scatter, traces, room);
    result.pdf =
        run_program({"weasyprint", "weasyprint"}, {"--quiet", "-", "-"}, result.html, kPatience);
    result.pages = pages_of(result.pdf);
    if (result.pages == 1) break;
  }
  return result;
}

namespace {

namespace fs = std::filesystem;

[[noreturn]] void fail(const fs::path& path, const std::string& what) {
  throw std::runtime_error(fmt::format("{}: {}; nothing was written", path.string(), what));
}

[[noreturn]] void fail(const fs::path& path) { fail(path, std::strerror(errno)); }

void write_all(int fd, std::string_view text, const fs::path& path) {
  while (!text.empty()) {
    const ssize_t n = ::write(fd, text.data(), text.size());
    if (n < 0 && errno != EINTR) fail(path);
    if (n > 0) text.remove_prefix(static_cast<std::size_t>(n));
  }
}

/// One file on its way to its name.
class Arrival {
 public:
  Arrival(const NamedText& file, bool replace) : path_(file.path), replace_(replace) {
    const fs::path folder = path_.has_parent_path() ? path_.parent_path() : fs::path(".");
    std::string name = (folder / fmt::format(".{}-XXXXXX", path_.filename().string())).string();
    const UniqueFd fd(::mkostemp(name.data(), O_CLOEXEC));
    if (!fd) fail(path_);
    temporary_ = name;
    try {
      write_all(fd.get(), file.text, path_);
      const mode_t mask = ::umask(0);
      ::umask(mask);
      if (::fchmod(fd.get(), 0666 & ~mask) != 0 || ::fsync(fd.get()) != 0) fail(path_);
    } catch (...) {
      ::unlink(temporary_.c_str());
      throw;
    }
  }
  Arrival(const Arrival&) = delete;
  Arrival& operator=(const Arrival&) = delete;
  /// Unless all arrived: as if nothing had been.
  ~Arrival() {
    if (!temporary_.empty()) ::unlink(temporary_.c_str());
    if (kept_) return;
    if (!old_.empty()) {
      ::rename(old_.c_str(), path_.c_str());
    } else if (named_) {
      ::unlink(path_.c_str());
    }
  }

  void take_the_name() {
    if (replace_ && fs::exists(fs::symlink_status(path_))) set_the_old_one_aside();
    if (::renameat2(AT_FDCWD, temporary_.c_str(), AT_FDCWD, path_.c_str(), RENAME_NOREPLACE) != 0) {
      if (errno == EEXIST) fail(path_, "is there already; give another name, or --force");
      fail(path_);
    }
    temporary_.clear();
    named_ = true;
  }
  void keep() {
    kept_ = true;
    if (!old_.empty()) ::unlink(old_.c_str());
  }

 private:
  void set_the_old_one_aside() {
    if (!fs::is_regular_file(path_)) fail(path_, "is no regular file, which alone is replaced");
    const std::string aside = temporary_ + ".old";
    if (::rename(path_.c_str(), aside.c_str()) != 0) fail(path_);
    old_ = aside;
  }

  fs::path path_;
  bool replace_;
  std::string temporary_;  ///< empty when it has its name
  std::string old_;        ///< what had the name before, under another one
  bool named_ = false;
  bool kept_ = false;
};

}  // namespace

void write_together(const std::vector<NamedText>& files, bool replace) {
  std::vector<std::unique_ptr<Arrival>> arrivals;
  for (const NamedText& file : files) arrivals.push_back(std::make_unique<Arrival>(file, replace));
  for (const auto& arrival : arrivals) arrival->take_the_name();
  for (const auto& arrival : arrivals) arrival->keep();
}

}  // namespace tagwrench
