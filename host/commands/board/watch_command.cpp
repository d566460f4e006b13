// `tagwrench board watch` and `tagwrench board log`.
#include <fmt/format.h>

#include "host/board/cell_calibration.h"
#include "host/commands/board/options.h"
#include "host/commands/board/text.h"
#include "host/core/log.h"
#include "host/output/text_sink.h"

namespace tagwrench {
namespace {

/// One board, one stream of lines.
class Watch {
 public:
  enum class Style { people, json, csv };

  Watch(const BoardOptions& options, Style style, const std::string& path)
      : options_(options),
        style_(style),
        path_(path),
        out_(path, /*lossless=*/true),
        loop_(options.port, session_options(options)) {}

  int run() {
    if (!loop_.settle()) return 0;
    drop_samples();
    load_calibrations();
    if (style_ == Style::csv && !options_.seconds)
      log_info(fmt::format("writing to {}; Ctrl-C ends it", place()));
    const TimePoint begin = clock_now();
    const TimePoint end =
        options_.seconds ? begin + in_seconds(*options_.seconds) : TimePoint::max();
    next_line_ = begin + period();
    bool good = style_ != Style::csv || write(kBoardCsvHeader);
    while (good && clock_now() < end) {
      if (!loop_.turn(style_ == Style::people ? std::min(end, next_line_) : end)) break;
      good = take_samples();
      if (good && style_ == Style::people && clock_now() >= next_line_) good = write_view();
    }
    if (good && style_ == Style::csv)
      log_info(fmt::format("{} samples and events written to {}", samples_, place()));
    say_losses();
    if (!good) log_info(out_.failure());
    return good ? 0 : 1;
  }

 private:
  std::string place() const { return path_ == "-" ? "standard output" : path_; }

  /// What came while the clock was being settled; nobody asked for it, and some of it is lost.
  void drop_samples() {
    link::BoardSession& session = loop_.session();
    for (link::CellReading r; session.next(r);) {
    }
    for (link::AdcReading r; session.next(r);) {
    }
    overwritten_before_ = session.overwritten();
  }

  Duration period() const { return in_seconds(options_.line_period); }

  void load_calibrations() {
    cells_ = load_cells(options_, loop_.session());
    if (std::none_of(cells_.begin(), cells_.end(), [](const auto& c) { return c.calibrated; }))
      log_info(
          "the load cells are not calibrated: showing counts; `tagwrench board calibrate-cell` "
          "makes newtons of them");
  }

  bool take_samples() {
    link::BoardSession& session = loop_.session();
    bool good = true;
    for (link::CellReading r; good && session.next(r);) {
      loop_.cell_spoke(r.channel);
      view_.take(r);
      good = write_sample([&] { return json_line(r, cells_[r.channel]); },
                          [&] { return csv_line(r, cells_[r.channel]); });
    }
    for (link::AdcReading r; good && session.next(r);) good = take(r);
    for (link::ButtonReading r; good && session.next(r);) good = take(r);
    for (link::FaultReading r; good && session.next(r);) {
      good = write_sample([&] { return json_line(r); }, [&] { return csv_line(r); });
    }
    return good && flush();
  }

  template <class Reading>
  bool take(const Reading& reading) {
    view_.take(reading);
    return write_sample([&] { return json_line(reading); }, [&] { return csv_line(reading); });
  }

  template <class Json, class Csv>
  bool write_sample(const Json& json, const Csv& csv) {
    if (style_ == Style::people) return true;
    ++samples_;
    return write(style_ == Style::json ? json() : csv());
  }

  bool write_view() {
    next_line_ = clock_now() + period();
    if (!loop_.link().plugged()) return true;
    return write(view_.line(cells_, loop_, clock_now() - std::chrono::seconds(1))) && flush();
  }

  /// Lines that came together go out together.
  bool write(const std::string& text) {
    if (lines_.size() + text.size() > TextSink::kMaxBlock && !flush()) return false;
    lines_ += text;
    return true;
  }

  bool flush() {
    const bool good = lines_.empty() || out_.write(lines_) != SendStatus::failed;
    lines_.clear();
    return good;
  }

  void say_losses() {
    const link::SessionCounters counters = loop_.session().counters();
    const std::uint64_t lost =
        counters.lost_conversions + loop_.session().overwritten() - overwritten_before_;
    if (lost > 0 || counters.damaged_frames > 0)
      log_info(fmt::format("{} samples were lost, {} frames came damaged", lost,
                           counters.damaged_frames));
  }

  const BoardOptions& options_;
  Style style_;
  std::string path_;
  TextSink out_;
  std::uint64_t samples_ = 0;  ///< written, events among them
  std::string lines_;
  BoardLoop loop_;
  link::CellCalibrations cells_{};
  BoardView view_;
  TimePoint next_line_{};
  std::uint64_t overwritten_before_ = 0;
};

}  // namespace

int board_watch(const BoardOptions& options) {
  check_cells_file(options);
  return Watch(options, options.json ? Watch::Style::json : Watch::Style::people, "-").run();
}

int board_log(const BoardOptions& options) {
  check_cells_file(options);
  return Watch(options, Watch::Style::csv, options.out).run();
}

}  // namespace tagwrench
