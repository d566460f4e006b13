// Any bytes from devices, and as what the kernel says of them: HID descriptors and reports,
// /proc/bus/input/devices, names.
#include <cmath>
#include <cstring>
#include <string_view>
#include <vector>

#include "host/core/printable.h"
#include "host/tools/doctor/doctor.h"
#include "host/tools/reading/reader.h"
#include "host/tools/reading/tagwrench_hid.h"
#include "tests/fuzz/expect.h"

namespace {

using namespace tagwrench;

void report(const std::vector<std::uint8_t>& bytes) {
  tagwrench_sample sample;
  std::memset(&sample, 0x55, sizeof sample);
  const tagwrench_sample before = sample;
  const int result = tagwrench_decode(bytes.data(), bytes.size(), &sample);
  expect(result == 1 || (result <= TAGWRENCH_ERROR_SIZE && result >= TAGWRENCH_ERROR_FIELD),
         "a report is a sample or an error");
  if (result != 1) {
    expect(std::memcmp(&before, &sample, sizeof sample) == 0, "an error leaves the sample alone");
    return;
  }
  for (int i = 0; i < 3; ++i) {
    expect(std::isfinite(sample.force_n[i]) && std::isfinite(sample.torque_nm[i]), "finite");
    expect(sample.force_sigma_n[i] >= 0 && sample.torque_sigma_nm[i] >= 0, "a sigma is none less");
    expect(sample.has_numbers || sample.force_n[i] == 0, "no numbers, no force");
  }
}

void text(std::string_view bytes) {
  for (const InputDevice& device : other_6dof_devices(bytes))
    expect(printable(device.name) == device.name, "a name is fit to be shown");
  const std::string shown = printable(bytes);
  for (const char c : shown)
    expect(static_cast<unsigned char>(c) >= 0x20 && c != 0x7f, "nothing is obeyed");
  expect(printable(shown) == shown, "what is printable stays as it is");
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t count) {
  const std::vector<std::uint8_t> own(bytes, bytes + count);
  top_level_usages(own);
  report(own);
  text({reinterpret_cast<const char*>(own.data()), own.size()});
  return 0;
}
