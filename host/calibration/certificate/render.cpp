// The figures of a certificate by gnuplot, its PDF by weasyprint, and its three files.
#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <spawn.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cerrno>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <iterator>
#include <stdexcept>

#include "host/calibration/certificate/certificate.h"
#include "host/core/config_error.h"
#include "host/core/os/atomic_file.h"
#include "host/core/os/unique_fd.h"

extern char** environ;

// Not fuzzed: what our own gnuplot and weasyprint have written; fuzz.tables has data.

namespace tagwrench {
namespace {

/// A file in memory: neither side can block the other, as with pipes.
struct MemoryFile {
  UniqueFd fd{::memfd_create("tagwrench", MFD_CLOEXEC)};
  std::string path = fmt::format("/proc/self/fd/{}", fd.get());

  std::string contents() const {
    std::ifstream in(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
  }
};

std::string last_line(std::string text) {
  while (!text.empty() && std::isspace(static_cast<unsigned char>(text.back()))) text.pop_back();
  const std::size_t begin = text.rfind('\n');
  return begin == std::string::npos ? text : text.substr(begin + 1);
}

pid_t start(const Program& program, const std::vector<std::string>& arguments, int in, int out,
            int err) {
  std::vector<std::string> all(1, program.name);
  all.insert(all.end(), arguments.begin(), arguments.end());
  std::vector<char*> argv;
  for (std::string& a : all) argv.push_back(a.data());
  argv.push_back(nullptr);
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_adddup2(&actions, in, STDIN_FILENO);
  posix_spawn_file_actions_adddup2(&actions, out, STDOUT_FILENO);
  posix_spawn_file_actions_adddup2(&actions, err, STDERR_FILENO);
  pid_t pid = -1;
  const int error =
      ::posix_spawnp(&pid, program.name.c_str(), &actions, nullptr, argv.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  if (error == 0) return pid;
  throw ConfigError("{}: {}; install it (Debian: apt install {})", program.name,
                    error == ENOENT ? "is not installed" : std::strerror(error), program.package);
}

/// Its wait status; if it takes longer than that, it is ended.
int wait(pid_t pid, std::chrono::seconds patience, bool& in_time) {
  // By number: sys/pidfd.h of glibc 2.36 is not made for C++.
  const UniqueFd handle(static_cast<int>(::syscall(SYS_pidfd_open, pid, 0)));
  pollfd entry{handle.get(), POLLIN, 0};
  const auto patience_ms =
      static_cast<int>(std::chrono::duration_cast<std::chrono::milliseconds>(patience).count());
  int ready = 0;
  do {
    ready = ::poll(&entry, 1, patience_ms);
  } while (ready < 0 && errno == EINTR);
  in_time = ready > 0;
  if (!in_time) ::kill(pid, SIGKILL);
  int status = 0;
  while (::waitpid(pid, &status, 0) < 0 && errno == EINTR) {
  }
  return status;
}

using study::Analysis;

constexpr std::chrono::seconds kPatience{120};
constexpr Eigen::Index kMaxDots = 500;     // of a panel
constexpr Eigen::Index kMaxColumns = 420;  // of a trace: about one a pixel of paper
constexpr double kPause = 16;              // typical steps of time, drawn between trials ...
constexpr double kMaxPauses = 0.5;         // ... but all together no more of the time that is shown

/// Forces in N, torques in mN m.
double shown(double value, int axis) { return axis < 3 ? value : 1e3 * value; }
const char* unit(int axis) { return axis < 3 ? "N" : "mN m"; }

bool drawable(const Analysis& a, int axis) { return a.axis[axis].calibrated && a.time.size() > 0; }

/// Round numbers that enclose all values; never empty.
struct Span {
  double low = 0, high = 0;
};

Span span(const Analysis& a, int axis) {
  Span s{0, 0};
  for (Eigen::Index i = 0; i < a.time.size(); ++i) {
    for (const double value : {a.predicted(i, axis), a.felt(i, axis)}) {
      if (!std::isfinite(value)) continue;
      s.low = std::min(s.low, shown(value, axis));
      s.high = std::max(s.high, shown(value, axis));
    }
  }
  const double margin = std::max(0.06 * (s.high - s.low), 1e-9);
  return {s.low - margin, s.high + margin};
}

/// 1, 2 or 5 times a power of ten: about `count` of them in the span.
double tick(const Span& s, int count) {
  const double wanted = (s.high - s.low) / count;
  const double decade = std::pow(10, std::floor(std::log10(wanted)));
  for (const double step : {1.0, 2.0, 5.0})
    if (step * decade >= wanted) return step * decade;
  return 10 * decade;
}

std::string terminal(PlotSize size) {
  // The font is the page's: the SVG stands in it. Dots are the round ends of lines.
  return fmt::format(
      "set encoding utf8\n"
      "set terminal svg size {},{} dynamic font 'sans-serif,7.5' linewidth 0.6 rounded background "
      "'#ffffff'\n"
      "set key off\n"
      "set tics scale 0.4 nomirror textcolor '#333333'\n"
      "set border 3 linecolor '#777777' linewidth 0.7\n",
      size.width, size.height);
}

/// Leaves the x axis and the axis' name as they are.
constexpr const char* kEmptyPanel =
    "unset ytics\nset yrange [0:1]\n"
    "set label 3 'not calibrated' at graph 0.5,0.5 center textcolor '#888888'\n"
    "plot NaN notitle\n";

std::string named(int axis, const char* name_place, const char* unit_place) {
  return fmt::format(
      "set label 1 '{}' at graph {} left font ',8.5'\n"
      "set label 2 '{}' at graph {} left textcolor '#555555'\n",
      kWrenchAxes[axis], name_place, unit(axis), unit_place);
}

constexpr const char* kForgetLabels = "unset label 1\nunset label 2\nunset label 3\n";

std::string scatter_panel(const Analysis& a, int axis) {
  const Span s = span(a, axis);
  // A dot is a short line with round ends: gnuplot's own points are <use> elements in currentColor,
  // which weasyprint 57 does not draw.
  const double short_line = 2e-3 * (s.high - s.low);
  std::string script = "$dots << END\n";
  const Eigen::Index stride = std::max<Eigen::Index>(1, a.time.size() / kMaxDots);
  for (Eigen::Index i = 0; i < a.time.size(); i += stride) {
    const double x = shown(a.felt(i, axis), axis), y = shown(a.predicted(i, axis), axis);
    if (std::isfinite(x) && std::isfinite(y))
      script += fmt::format("{:.6g} {:.6g}\n{:.6g} {:.6g}\n\n", x, y, x + short_line, y);
  }
  script += "END\n" + named(axis, "0.04,0.93", "0.04,0.80");
  script += fmt::format(
      "set xrange [{0:.6g}:{1:.6g}]\nset yrange [{0:.6g}:{1:.6g}]\n"
      "set xtics nomirror scale 0.4 {2:.6g} offset 0,0.5\n"
      "set ytics nomirror scale 0.4 {2:.6g} offset 0.7,0\n"
      "plot x with lines linecolor '#000000' linewidth 0.8, $dots using 1:2 with lines linecolor "
      "'#d62728' linewidth {3}\n",
      s.low, s.high, tick(s, 6), a.reference_rate > 0 ? 3 : 6);
  return script;
}

/// Whether a line goes on from row i - 1 to row i.
bool goes_on(const Analysis& a, Eigen::Index i) {
  return a.segment.size() != a.time.size() || a.segment[i] == a.segment[i - 1];
}

/// From 0 on, with short pauses between segments, however long they were: a trial may begin
/// earlier than the one before has ended, and loads hang for seconds, minutes apart.
Eigen::VectorXd running_time(const Analysis& a) {
  Eigen::VectorXd passed = Eigen::VectorXd::Zero(a.time.size());  // 0: a pause
  for (Eigen::Index i = 1; i < a.time.size(); ++i)
    if (goes_on(a, i)) passed[i] = std::max(0.0, a.time[i] - a.time[i - 1]);
  const auto pauses = static_cast<double>(std::max<Eigen::Index>(1, (passed.array() == 0).count()));
  const double most = kMaxPauses * passed.sum() / pauses;
  const double step = kPause * std::max(study::median_interval(a.time), 1e-9);
  const double pause = most > 0 ? std::min(step, most) : step;
  Eigen::VectorXd running = Eigen::VectorXd::Zero(a.time.size());
  for (Eigen::Index i = 1; i < a.time.size(); ++i)
    running[i] = running[i - 1] + (passed[i] > 0 ? passed[i] : pause);
  return running;
}

/// One column of numbers over time. Where there are more readings than pixels, the least and the
/// greatest of each pixel, so that no peak is lost. Empty lines break the line.
std::string trace_data(const Analysis& a, const Eigen::VectorXd& time,
                       const Eigen::MatrixXd& values, int axis) {
  const Eigen::Index most = std::max<Eigen::Index>(1, 2 * time.size() / kMaxColumns);
  std::string text;
  const auto add = [&](Eigen::Index i) {
    if (std::isfinite(values(i, axis)))
      text += fmt::format("{:.7g} {:.6g}\n", time[i], shown(values(i, axis), axis));
  };
  for (Eigen::Index begin = 0; begin < time.size();) {
    if (begin > 0 && !goes_on(a, begin)) text += "\n";
    Eigen::Index end = begin + 1;
    while (end < time.size() && end < begin + most && goes_on(a, end)) ++end;
    Eigen::Index low = 0, high = 0;
    values.col(axis).segment(begin, end - begin).minCoeff(&low);
    values.col(axis).segment(begin, end - begin).maxCoeff(&high);
    add(begin + std::min(low, high));
    if (low != high) add(begin + std::max(low, high));
    begin = end;
  }
  return text;
}

std::string trace_panel(const Analysis& a, const Eigen::VectorXd& time, int axis) {
  const Span s = span(a, axis);
  const bool moving = a.reference_rate > 0;
  return fmt::format(
      "$felt << END\n{}END\n$ours << END\n{}END\n"
      "set yrange [{:.6g}:{:.6g}]\nset ytics nomirror scale 0.4 {:.6g} offset 0.7,0\n"
      "plot $felt using 1:2 with lines linecolor '#000000' linewidth {}, $ours using 1:2 with "
      "lines linecolor '#d62728' linewidth {}\n",
      trace_data(a, time, a.felt, axis), trace_data(a, time, a.predicted, axis), s.low, s.high,
      tick(s, 5), moving ? 2.0 : 5.0, moving ? 0.9 : 1.6);
}

/// Without the declarations that may stand only at the start of a file.
std::string draw(const std::string& script) {
  const std::string svg = run_program({"gnuplot", "gnuplot-nox"}, {"-d", "-"}, script, kPatience);
  const std::size_t begin = svg.find("<svg");
  if (begin == std::string::npos) throw std::runtime_error("gnuplot failed: it drew no SVG");
  return svg.substr(begin);
}

std::string placed(double left, double bottom, double width, double height) {
  return fmt::format(
      "set lmargin at screen {:.5f}\nset rmargin at screen {:.5f}\n"
      "set bmargin at screen {:.5f}\nset tmargin at screen {:.5f}\n",
      left, left + width, bottom, bottom + height);
}

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
  for (std::size_t at = pdf.find(kPage); at != std::string::npos; at = pdf.find(kPage, at + 1))
    if (at + kPage.size() < pdf.size() && pdf[at + kPage.size()] != 's') ++count;
  if (count == 0) throw std::runtime_error("weasyprint failed: its PDF has no page");
  return count;
}

namespace fs = std::filesystem;

[[noreturn]] void fail(const fs::path& path, const std::string& what) {
  throw std::runtime_error(fmt::format("{}: {}; nothing was written", path.string(), what));
}

[[noreturn]] void fail(const fs::path& path) { fail(path, std::strerror(errno)); }

/// One file on its way to its name.
struct Arrival {
  fs::path path;
  NewFile file{path};
  std::string old{};  ///< what had the name before, under another one
  bool named = false;
};

void take_the_name(Arrival& arrival, bool replace) {
  const fs::path& path = arrival.path;
  if (replace && fs::exists(fs::symlink_status(path))) {
    if (!fs::is_regular_file(path)) fail(path, "is no regular file, which alone is replaced");
    const std::string aside = arrival.file.temporary().string() + ".old";
    if (::rename(path.c_str(), aside.c_str()) != 0) fail(path);
    arrival.old = aside;
  }
  arrival.file.take_the_name(NewFile::Existing::refused);
  arrival.named = true;
}

}  // namespace

std::string run_program(const Program& program, const std::vector<std::string>& arguments,
                        std::string_view input, std::chrono::seconds patience) {
  const MemoryFile in, out, err;
  if (!(std::ofstream(in.path, std::ios::binary) << input).flush() || !out.fd || !err.fd)
    throw std::runtime_error(fmt::format("{} cannot be started: no memory", program.name));
  const pid_t pid = start(program, arguments, in.fd.get(), out.fd.get(), err.fd.get());
  bool in_time = false;
  const int status = wait(pid, patience, in_time);
  if (!in_time) {
    throw std::runtime_error(
        fmt::format("{} did not end within {} s", program.name, patience.count()));
  }
  if (!WIFEXITED(status) || WEXITSTATUS(status) != 0) {
    const std::string said = last_line(err.contents());
    throw std::runtime_error(
        fmt::format("{} failed: {}", program.name, said.empty() ? "it does not say why" : said));
  }
  return out.contents();
}

std::string scatter_svg(const Analysis& analysis, PlotSize size) {
  std::string script = terminal(size) + "set multiplot\n";
  const double cell_width = 1.0 / 3, cell_height = 1.0 / 2;
  const double left = 26.0 / size.width, below = 16.0 / size.height;
  for (int axis = 0; axis < 6; ++axis) {
    script += placed(axis % 3 * cell_width + left, (1 - axis / 3) * cell_height + below,
                     cell_width - left - 4.0 / size.width, cell_height - below - 5.0 / size.height);
    script += drawable(analysis, axis) ? scatter_panel(analysis, axis)
                                       : named(axis, "0.04,0.93", "0.04,0.80") +
                                             "unset xtics\nset xrange [0:1]\n" + kEmptyPanel;
    script += kForgetLabels;
  }
  return draw(script + "unset multiplot\n");
}

std::string traces_svg(const Analysis& analysis, PlotSize size) {
  const Eigen::VectorXd time = running_time(analysis);
  const Span seconds{0, time.size() > 1 ? time[time.size() - 1] : 1};
  std::string script = terminal(size) +
                       fmt::format("set xrange [0:{:.7g}]\nset xtics {:.6g} offset 0,0.5\n",
                                   seconds.high, tick(seconds, 10)) +
                       "set format x ''\nset multiplot\n";
  const double below = 15.0 / size.height, left = 54.0 / size.width;
  const double width = 1 - left - 8.0 / size.width;
  const double cell = (1 - below) / 6;
  const std::string beside = fmt::format("{:.4f}", -52.0 / size.width / width);
  for (int axis = 0; axis < 6; ++axis) {
    script += placed(left, below + (5 - axis) * cell + 1.5 / size.height, width,
                     cell - 5.0 / size.height);
    script += named(axis, (beside + ",0.74").c_str(), (beside + ",0.26").c_str());
    if (axis == 5) script += "set format x '%g'\n";
    script += drawable(analysis, axis) ? trace_panel(analysis, time, axis) : kEmptyPanel;
    script += kForgetLabels;
  }
  return draw(script + "unset multiplot\n");
}

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

void write_together(const std::vector<NamedText>& files, bool replace) {
  std::vector<Arrival> arrivals;
  try {
    for (const NamedText& file : files)
      arrivals.emplace_back(Arrival{file.path}).file.write(file.text);
    for (Arrival& arrival : arrivals) take_the_name(arrival, replace);
  } catch (...) {
    // As if nothing had been.
    for (const Arrival& arrival : arrivals) {
      if (!arrival.old.empty())
        ::rename(arrival.old.c_str(), arrival.path.c_str());
      else if (arrival.named)
        ::unlink(arrival.path.c_str());
    }
    throw;
  }
  for (const Arrival& arrival : arrivals)
    if (!arrival.old.empty()) ::unlink(arrival.old.c_str());
}

}  // namespace tagwrench
