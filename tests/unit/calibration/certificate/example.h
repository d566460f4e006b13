// A certificate made by hand: all figures are known, every field is filled.
#pragma once

#include <cmath>

#include "host/calibration/certificate/certificate.h"

namespace tagwrench::test {

/// Two minutes at 25 Hz; Mz was not excited.
inline Certificate example_certificate() {
  Certificate c;
  c.number = "0123456789AB";
  c.issued = "2020-05-31";
  c.software = "tagwrench 0.1.0";
  c.sensor = {{"Tags", "aruco_original 5, 2 of 3.8 mm"},
              {"Camera", "640 x 480 px, focal length 805 px"},
              {"Target", "SHA-256 9f86d081884c7d65…"}};
  c.procedure = {{"Date", "2020-05-30T12:00:00Z"},
                 {"Plan", "masses-three-mountings"},
                 {"Reference", "masses of 50 g, 0.3 %"},
                 {"Model", "linear, 6 x 6 with offset"},
                 {"Environment", "21 °C, on a bench"}};
  c.data = {{"calibration.data.csv", std::string(64, 'a'), 123456}};
  study::Analysis& a = c.analysis;
  a.names = {"example"};
  a.readings = 3000;
  a.references = 12000;
  a.seconds = 120;
  a.reading_rate = 25;
  a.reference_rate = 100;
  a.lag.known = true;
  a.lag.value = 0.0412;
  a.lag.sigma = 0.0007;
  a.condition = 34.5;
  a.weakest = "Mz";
  a.validation = "5 blocks in time";
  a.time.resize(3000);
  a.felt.resize(3000, 6);
  a.predicted.resize(3000, 6);
  for (Eigen::Index i = 0; i < 3000; ++i) {
    a.time[i] = 0.04 * static_cast<double>(i);
    for (int axis = 0; axis < 6; ++axis) {
      const double size = axis < 3 ? 0.4 + 0.5 * axis : 0.004;
      a.felt(i, axis) = size * std::sin(0.2 * (axis + 1) * a.time[i]) * std::cos(0.11 * a.time[i]);
      a.predicted(i, axis) =
          a.felt(i, axis) + 0.01 * size * std::sin(12.9898 * static_cast<double>(i * (axis + 1)));
    }
  }
  for (int axis = 0; axis < 6; ++axis) {
    study::AxisReport& r = a.axis[static_cast<std::size_t>(axis)];
    const double size = axis < 3 ? 0.4 + 0.5 * axis : 0.004;
    r.range_low = -0.98 * size;
    r.range_high = size;
    r.full_scale = size;
    r.r2 = 0.99987;
    r.r2_in_sample = 0.99991;
    r.rmse = 0.0071 * size;
    r.rmse_percent = 0.71;
    r.nonlinearity_percent = 0.12;
    r.hysteresis_percent = 0.08;
    r.noise = 0.0004 * size;
    r.noise_density = 0.0001 * size;
    r.resolution = 0.0011 * size;
    r.drift_per_hour = 0.003 * size;
    r.creep_percent = 0.05;
    r.coverage = 0.951;
    r.excitation = 340;
    for (int other = 0; other < 6; ++other) a.cross_talk(axis, other) = 0.1 * (axis - other);
  }
  a.cross_talk(2, 0) = 1.4;
  a.axis[5].calibrated = false;
  a.axis[5].reason = "no torque about z was applied: 0.9 times the reference's noise";
  a.warnings = {"the reference lags by 41 ms"};
  return c;
}

}  // namespace tagwrench::test
