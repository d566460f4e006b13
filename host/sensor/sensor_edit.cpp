#include "host/sensor/sensor_edit.h"

#include "host/core/os/atomic_file.h"
#include "host/sensor/sensor_config.h"

namespace tagwrench {

void write_sensor(std::string yaml, const std::vector<SectionEdit>& edits,
                  const std::filesystem::path& to) {
  for (const SectionEdit& edit : edits) yaml = with_keys(yaml, edit, to.string());
  // What is calibrated anew may make a calibration of the wrench void; that is no reason to refuse.
  parse_sensor(yaml, to.string(), WrenchCalibration::ignore);
  write_atomically(to, yaml);
}

}  // namespace tagwrench
