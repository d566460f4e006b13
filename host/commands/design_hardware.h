// `tagwrench design` for a file of hardware/sensors: whether it can be built, and what follows.
#pragma once

#include <string>

#include "host/tools/design/design.h"
#include "host/tools/design/parameters.h"

namespace tagwrench {

/// Size and focal length of the picture.
void take_lens(const CameraModel& camera, study::SeenPicture& picture);

/// What is counted of an instrument whose picture and origin are known. `image_px`: of the
/// rectangle around the papers; m.
void count_pixels(const Eigen::Vector2d& image_px, double tag_size, double border,
                  study::Instrument& instrument);

/// What will be printed, as the design sees it; blur, noise, contrast and counts stay as they were.
void take_hardware(const hardware::Parameters& parameters, study::Instrument& instrument);

/// The ready-made plan six_orientations as text, its four points and its weight those of this
/// sensor; its comments stay.
std::string hardware_plan(const hardware::Parameters& parameters);

/// All complaints, one a line, to standard output; returns the exit status: 0 it can be built, 2 it
/// cannot. Throws ConfigError for a file that cannot be read.
int check_hardware(const std::string& file);

/// parameters.scad, sensor.yaml, scenario.yaml and plan.yaml (for `calibrate wrench`) of the
/// sensor, into `folder`, which may be there. Throws ConfigError for what cannot be built or
/// written, and, unless `force`, where one of these files is there and holds something else (a
/// calibration may have edited it): then nothing is written.
void export_hardware(const std::string& file, const std::string& folder, bool force);

}  // namespace tagwrench
