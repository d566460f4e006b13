// Load cells: newtons of their counts, a straight line per channel from known masses; and what they
// felt at another clock's time, that of a frame.
#pragma once

#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "host/board/ring.h"
#include "host/core/types.h"
#include "protocol/codec.h"

namespace tagwrench::link {

constexpr double kStandardGravity = 9.80665;  ///< m/s^2, by definition (CGPM 1901)

/// What the cell showed under one mass.
struct CellPoint {
  double mass_kg = 0;
  double mean_counts = 0;
  double sigma_counts = 0;  ///< of the mean
};

struct Newtons {
  double value = 0;
  double sigma = 0;  ///< one standard deviation: noise, zero and scale
};

struct CellCalibration {
  bool calibrated = false;
  double newtons_per_count = 0;
  double newtons_per_count_sigma = 0;
  double zero_counts = 0;
  double zero_sigma_counts = 0;
  double zero_scale_covariance_n = 0;  ///< of zero_counts and newtons_per_count: one line's both
  double noise_counts = 0;             ///< standard deviation of one conversion
  double residual_n = 0;               ///< rms of the points about the line; 0 of two points

  /// Only when calibrated.
  Newtons newtons(double counts) const noexcept;
};

constexpr std::size_t kMaxChannels = 4;
using CellCalibrations = std::array<CellCalibration, kMaxChannels>;

/// The line through two points, or nearest to more of them by least squares; zero is where no mass
/// weighs. Its uncertainty is that of the points, or what they scatter about the line if that is
/// more. Throws ConfigError if the masses do not span: fewer than two different ones, or counts
/// that differ by less than 20 of their standard deviations.
CellCalibration fit_cell(const std::vector<CellPoint>& points, double gravity = kStandardGravity);

// What is known about a board's load cells, kept in a file by the board's id.

constexpr const char* kMakeAnew = "remove it and run `tagwrench board calibrate-cell`";

/// "0102030405060708"; empty for a board without id.
std::string id_text(const UniqueId& id);

/// $XDG_CONFIG_HOME/tagwrench/board-<id>.json, or the same in ~/.config. Throws ConfigError if
/// neither variable says where.
std::string cell_file_path(const std::string& board_id);

/// All channels uncalibrated if there is no such file. No number is beyond 1e12.
///
///   {"format": "tagwrench-cells-1", "board": "0102030405060708",
///    "cells": [{"channel": 0, "newtons_per_count": 1e-5, "newtons_per_count_sigma": 1e-9,
///               "zero_counts": 8123.5, "zero_sigma_counts": 0.6,
///               "zero_scale_covariance_n": 0, "noise_counts": 5.1, "residual_n": 0}]}
///
/// Throws ConfigError if it cannot be read, is not such a file, or belongs to another board
/// (`board_id` empty: any); `remedy` is what is said to do about a file that is not such a one.
CellCalibrations load_cells(const std::string& path, const std::string& board_id,
                            const std::string& remedy = kMakeAnew);

/// Writes a file beside it first and then takes its place. Throws ConfigError if that fails.
void save_cells(const std::string& path, const std::string& board_id,
                const CellCalibrations& cells);

enum class AlignStatus : std::uint8_t {
  ok,
  empty,    ///< nothing was sampled yet
  too_old,  ///< before all that is kept
  too_new,  ///< after the last sample: ask again later, it is not guessed
  gap,      ///< samples are missing there
};

struct Aligned {
  AlignStatus status = AlignStatus::empty;
  double value = 0;
  double sigma = 0;  ///< one standard deviation: noise, time and interpolation
};

struct HistoryOptions {
  double period = 0;  ///< s, nominal; neighbours further apart than 1.5 of it are a gap
  double delay =
      0;  ///< s between an event and the time stamp of the sample that shows it (filters)
};

/// Keeps the last samples and interpolates linearly between neighbours. The noise is what the
/// samples' third differences show: their variance is 20 times that of white noise, and signals
/// that change slowly have none. The interpolation's error is its bound u (1 - u) / 2 h^2 |f''|, by
/// the second differences.
class SampleHistory {
 public:
  static constexpr std::size_t kRoom = 512;

  explicit SampleHistory(const HistoryOptions& options) noexcept : options_(options) {}

  /// `sigma` is what is known of the value's uncertainty besides noise (a scale); `lost_before`
  /// tells of samples that are missing before this one. Times must grow; others are ignored.
  void add(TimePoint time, Duration time_sigma, double value, double sigma = 0,
           bool lost_before = false) noexcept;
  void clear() noexcept {
    samples_.clear();
    third_squares_ = 0;
    thirds_ = 0;
  }

  Aligned at(TimePoint time) const noexcept;
  /// Standard deviation of one sample, as seen; 0 before there are enough.
  double noise() const noexcept;

 private:
  struct Sample {
    TimePoint time{};
    double time_sigma = 0;  ///< s
    double value = 0;
    double sigma = 0;
    bool after_gap = false;
  };
  std::size_t first_after(TimePoint time) const noexcept;
  double bend(std::size_t right) const noexcept;
  void watch_noise() noexcept;

  HistoryOptions options_;
  Ring<Sample, kRoom> samples_;
  double third_squares_ = 0;  ///< mean, forgetting
  std::uint64_t thirds_ = 0;
};

}  // namespace tagwrench::link
