#include "host/commands/design_report.h"

#include <fmt/format.h>

#include <cmath>
#include <numbers>

namespace tagwrench {
namespace {

constexpr double kDegrees = 180 / std::numbers::pi;
constexpr double kToldApart = 1.96 * std::numbers::sqrt2;  // of two pictures, at 95 %
constexpr double kFlat = 0.05;                             // that a resonance adds at most
constexpr double kSameSprings = 0.005;                     // stiffness: alike in all digits shown

using study::Design;
using study::DesignRow;
using study::Instrument;

std::string steps(const Design& d) {
  const Vector6 told = kToldApart * d.bound;
  std::string text =
      "one picture      resolution    counted step      step of the bound    finer by\n";
  const auto line = [&](const char* what, int bits, double counted, double ours, double unit,
                        const char* name) {
    text += fmt::format("  {:<15}{:<14}{:>9.4f} {:<4}   {:>12.6f} {:<4}   {:>8.0f} x\n", what,
                        bits > 0 ? fmt::format("{} bits", bits) : "", unit * counted, name,
                        unit * ours, name, counted / ours);
  };
  line("x", d.counted.bits_x, d.counted.step_xy, told[0], 1e3, "mm");
  line("y", d.counted.bits_y, d.counted.step_xy, told[1], 1e3, "mm");
  line("z", d.counted.bits_z, d.counted.step_z, told[2], 1e3, "mm");
  line("about x", 0, d.counted.step_rxy, told[3], kDegrees, "deg");
  line("about y", 0, d.counted.step_rxy, told[4], kDegrees, "deg");
  line("about z", 0, d.counted.step_rz, told[5], kDegrees, "deg");
  return text;
}

std::string bound_note(const Instrument& i, const Design& d) {
  return fmt::format(
      "  counted: one count, {:g} to a px, by Ouyang & Howe (ICRA 2020); chord of 45 deg {:.2f} "
      "px,\n"
      "  foreshortening of 45 deg {:.2f} px. Bound: what two pictures tell apart at 95 %, 2.77 "
      "times\n"
      "  the Cramer-Rao bound from the tags' edges at {:g} grey levels of noise, contrast of "
      "{:g},\n"
      "  point spread of {:g} px; {:.3f} {:.3f} {:.3f} um, {:.4f} {:.4f} {:.4f} mrad (one "
      "standard\n"
      "  deviation).\n",
      i.counted.counts_per_px, d.counted.chord_px, d.counted.foreshortening_px,
      i.picture.noise_counts, i.picture.contrast_counts, i.picture.blur_px, 1e6 * d.bound[0],
      1e6 * d.bound[1], 1e6 * d.bound[2], 1e3 * d.bound[3], 1e3 * d.bound[4], 1e3 * d.bound[5]);
}

std::string bandwidth(const Instrument& i, const Design& d) {
  std::string modes;
  for (const double mode : d.modes) modes += fmt::format(" {:.1f}", mode);
  // An undamped mode at f makes 1 / (1 - (g / f)^2) of a load at g.
  const double flat = d.modes.front() * std::sqrt(1 - 1 / (1 + kFlat));
  return fmt::format(
      "\nbandwidth\n"
      "  pictures             {:.1f} Hz, half of {:g} a second\n"
      "  platform on springs {} Hz\n"
      "  true within {:.0f} %      up to {:.1f} Hz\n",
      0.5 * i.frame_rate, i.frame_rate, modes, 100 * kFlat, std::min(flat, 0.5 * i.frame_rate));
}

/// Three digits: "1.58 N", "312 N"; "beyond 1000 N".
std::string force(double newtons) {
  if (newtons > study::kMaxForce) return fmt::format("beyond {:g} N", study::kMaxForce);
  const int decimals = newtons >= 99.95 ? 0 : newtons >= 9.995 ? 1 : newtons >= 0.9995 ? 2 : 3;
  return fmt::format("{:.{}f} N", newtons, decimals);
}

std::string reach(const Design& d) {
  const char* axes[] = {"x", "y", "z"};
  std::string text = "\nlargest force    tags in view    springs not closed\n";
  for (int a = 0; a < 3; ++a) {
    const study::Reach& reach = d.reach[static_cast<std::size_t>(a)];
    text += fmt::format("  along {:<9}{:>13}    {}\n", axes[a], force(reach.in_view),
                        reach.to_solid ? force(*reach.to_solid) : "not known");
  }
  return text;
}

std::string row(const DesignRow& r, const std::string& name) {
  const Vector6 told = 1e3 * kToldApart * r.bound;
  return fmt::format(
      "  {:<9}{:>8.3g}{:>8.3g}  {:>5.2f} {:>5.2f}  {:>6.3g} {:>6.3g}   {:>7.2g} {:>7.2g} {:>7.2g}  "
      "{:>8.2g} {:>8.2g} {:>8.2g}  {:>5.0f}-{:<5.0f}\n",
      name, 1e-3 * r.lateral, 1e-3 * r.axial, 1e3 * r.travel_lateral, 1e3 * r.travel_axial,
      1e3 * r.counted_x, 1e3 * r.counted_y, told[0], told[1], told[2], told[3], told[4], told[5],
      r.lowest, r.highest);
}

std::string table(const Design& d) {
  std::string text =
      "\n  range        springs, N/mm   travel, mm   counted, mN      bound, mN                "
      "bound, "
      "mN m                    modes\n"
      "  +- N      lateral   axial    lat    ax      x      y        Fx      Fy      Fz        Mx  "
      " "
      "    My       Mz     Hz\n";
  for (std::size_t i = 0; i < d.rows.size(); ++i) {
    const DesignRow& r = d.rows[i];
    if (i > 0 && r.range == d.rows[0].range && std::abs(r.scale - 1) < kSameSprings) continue;
    text += row(r, i == 0 ? "given" : fmt::format("{:g}", r.range));
  }
  text += fmt::format(
      "  given: the springs as they are, under +- {:g} N; below, all springs stiffer or softer by\n"
      "  one factor, so that +- this force along any axis at the platform's origin just keeps "
      "tags\n"
      "  in view and coils apart. counted: 2 range / (counts per px x travel in px).\n",
      d.rows[0].range);
  return text;
}

std::string footnotes() {
  return "\nbeside the paper\n"
         "  - r_z is printed as 11 bits, but stands there as \"the same as the y-axis\", which has "
         "10.\n"
         "  - The printed yaw step divides the chord by 150: 81.18 / 150 / 4 = 0.135, no angle. "
         "What\n"
         "    is meant, 45 deg / 81.18 px / 4, is 0.139 deg; both round to the printed 0.14.\n"
         "  - Its y resolution is derived once without the \"+ 1\"; with it, 10 bits come out.\n"
         "  - 1.0 mN in x at +- 1 N takes springs that are softer in x than in y. Round ones are\n"
         "    equally stiff: where y has 2.1 mN, so has x.\n";
}

}  // namespace

std::string design_report(const Instrument& instrument, const Design& design) {
  return steps(design) + bound_note(instrument, design) + bandwidth(instrument, design) +
         reach(design) + table(design) + footnotes();
}

}  // namespace tagwrench
