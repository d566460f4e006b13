// What is known about a board's load cells, kept in a file by the board's id.
#pragma once

#include <string>

#include "host/board/cell_calibration.h"
#include "protocol/codec.h"

namespace tagwrench::link {

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

}  // namespace tagwrench::link
