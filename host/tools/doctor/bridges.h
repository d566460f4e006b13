// The sensors that run on this computer, and whether one starts by itself.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "host/tools/doctor/report.h"

namespace tagwrench {

/// Names of the sensors whose control sockets lie in `folder` and are listened to.
std::vector<std::string> running_sensors(const std::filesystem::path& folder);

/// Whether a user of `home` has told systemd to start it at login.
bool starts_at_login(const std::filesystem::path& home_configuration);

void say_bridges(Report& report);

}  // namespace tagwrench
