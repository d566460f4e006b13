// One sample as one line of text, formatted without heap. Numbers are the shortest that read back
// to the same double.
#pragma once

#include <array>
#include <cstdint>
#include <string_view>

#include "host/core/types.h"

namespace tagwrench {

/// Room for 24 doubles of at most 24 characters, the integers and the names.
using LineBuffer = std::array<char, 1536>;

/// The CSV columns are the JSON keys, flattened; displacement and wrench are named as in truth.csv
/// of the simulator.
inline constexpr std::string_view kCsvHeader =
    "seq,t_ns,status,"
    "dx_m,dy_m,dz_m,rx_rad,ry_rad,rz_rad,"
    "sigma_dx_m,sigma_dy_m,sigma_dz_m,sigma_rx_rad,sigma_ry_rad,sigma_rz_rad,"
    "fx_n,fy_n,fz_n,mx_nm,my_nm,mz_nm,"
    "sigma_fx_n,sigma_fy_n,sigma_fz_n,sigma_mx_nm,sigma_my_nm,sigma_mz_nm,"
    "dropped,latency_us\n";

/// A status that carries no numbers has zeros in all of them. The view is into `buffer` and ends
/// with a newline.
std::string_view json_line(LineBuffer& buffer, const Sample& sample) noexcept;
std::string_view csv_line(LineBuffer& buffer, const Sample& sample) noexcept;

/// Microseconds from the sample's latency origin to the output call, never negative.
std::int64_t latency_us(const Sample& sample) noexcept;

}  // namespace tagwrench
