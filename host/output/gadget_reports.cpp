#include "host/output/gadget_reports.h"

#include <algorithm>

#include "host/output/hid_report.h"

namespace tagwrench {
namespace {

std::int16_t count_at(const std::uint8_t* low) noexcept {
  return static_cast<std::int16_t>(low[0] | low[1] << 8);
}

/// Of a SpaceMouse's motion report.
Counts6 counts_of(const std::uint8_t* report) noexcept {
  Counts6 counts;
  for (std::size_t i = 0; i < counts.size(); ++i) counts[i] = count_at(report + 1 + 2 * i);
  return counts;
}

}  // namespace

GadgetReports::GadgetReports(GadgetFace face) noexcept : face_(face) {
  const auto add = [this](std::span<const std::uint8_t> neutral, bool stream, bool axes) {
    Kind& kind = kinds_[count_++];
    kind.id = neutral[0];
    kind.size = neutral.size();
    kind.stream = stream;
    kind.axes = axes;
    std::copy(neutral.begin(), neutral.end(), kind.newest.begin());
    kind.last = kind.newest;
  };
  if (face == GadgetFace::spacemouse) {
    add(spacemouse_button_report(0), false, false);
    add(spacemouse_report({}), true, true);
  } else {
    add(neutral_wrench_report(), true, false);
  }
}

void GadgetReports::put(std::span<const std::uint8_t> reports) noexcept {
  while (!reports.empty()) {
    const auto end = kinds_.begin() + static_cast<std::ptrdiff_t>(count_);
    const auto kind =
        std::find_if(kinds_.begin(), end, [&](const Kind& one) { return one.id == reports[0]; });
    if (kind == end || reports.size() < kind->size) return;
    put_one(*kind, reports.first(kind->size));
    reports = reports.subspan(kind->size);
  }
}

void GadgetReports::put_one(Kind& kind, std::span<const std::uint8_t> report) noexcept {
  std::copy(report.begin(), report.end(), kind.newest.begin());
  const bool changed = !std::equal(report.begin(), report.end(), kind.last.begin());
  kind.owed = kind.owed || kind.stream || changed;
}

void GadgetReports::rest() noexcept {
  *this = GadgetReports(face_);
  renew();
}

void GadgetReports::renew() noexcept {
  for (std::size_t i = 0; i < count_; ++i) kinds_[i].owed = true;
}

GadgetReports::Kind* GadgetReports::first_owed() noexcept {
  const auto end = kinds_.begin() + static_cast<std::ptrdiff_t>(count_);
  const auto kind = std::find_if(kinds_.begin(), end, [](const Kind& one) { return one.owed; });
  return kind == end ? nullptr : &*kind;
}

bool GadgetReports::owed() const noexcept {
  return std::any_of(kinds_.begin(), kinds_.begin() + static_cast<std::ptrdiff_t>(count_),
                     [](const Kind& one) { return one.owed; });
}

std::span<const std::uint8_t> GadgetReports::next() noexcept {
  const Kind* kind = first_owed();
  if (kind == nullptr) return {};
  if (!kind->axes) return kind->bytes();
  const SpacemouseReport report =
      spacemouse_report(dithered(counts_of(kind->newest.data()), counts_of(kind->last.data())));
  std::copy(report.begin(), report.end(), out_.begin());
  return {out_.data(), report.size()};
}

void GadgetReports::taken() noexcept {
  const std::span<const std::uint8_t> written = next();
  Kind* kind = first_owed();
  if (kind == nullptr) return;
  kind->owed = false;
  std::copy(written.begin(), written.end(), kind->last.begin());
}

}  // namespace tagwrench
