// Any bytes from a client of the service of devices: what is allowed to the kernel is a device of
// ours, and reports of it.
#include <cstring>
#include <memory>
#include <span>

#include "host/output/device_service.h"
#include "host/output/hid_outputs.h"
#include "tests/fuzz/expect.h"

namespace {

using namespace tagwrench;
using Bytes = std::span<const std::uint8_t>;

/// The first byte says how many are changed; three bytes each: place, and what is there then.
template <typename Event>
Bytes changed(Event& event, Bytes bytes) {
  auto* target = reinterpret_cast<std::uint8_t*>(&event);
  std::size_t count = bytes.empty() ? 0 : bytes[0] % 16;
  bytes = bytes.subspan(bytes.empty() ? 0 : 1);
  for (; count > 0 && bytes.size() >= 3; --count, bytes = bytes.subspan(3))
    target[(bytes[0] * 256U + bytes[1]) % sizeof event] = bytes[2];
  return bytes;
}

template <typename Event>
Bytes as_bytes(const Event& event) {
  return {reinterpret_cast<const std::uint8_t*>(&event), sizeof event};
}

void check_device(const uhid_create2_req& made) {
  const Bytes descriptor(made.rd_data, made.rd_size);
  const auto is = [&](Bytes ours) {
    return descriptor.size() == ours.size() &&
           std::memcmp(descriptor.data(), ours.data(), ours.size()) == 0;
  };
  expect(is(spacemouse_descriptor()) || is(wrench_descriptor()), "a device has our descriptor");
  expect(lent_id(made.vendor, made.product) && made.bus == BUS_USB, "and an id that is lent");
  expect(made.name[127] == 0 && made.phys[63] == 0 && made.uniq[63] == 0, "its texts have an end");
}

void check_report(Bytes event) {
  std::uint32_t type = 0;
  std::memcpy(&type, event.data(), sizeof type);
  switch (type) {
    case UHID_INPUT2:
      expect(event.size() <= 6 + 64 && event[4] + 256U * event[5] == event.size() - 6,
             "a report is as long as it says");
      return;
    case UHID_DESTROY: expect(event.size() == sizeof type, "an end has no more bytes"); return;
    default:
      expect((type == UHID_GET_REPORT_REPLY || type == UHID_SET_REPORT_REPLY) &&
                 event.size() == sizeof(uhid_event),
             "nothing else reaches the kernel but answers");
  }
}

void check_uhid(Bytes bytes) {
  const bool wrench = !bytes.empty() && (bytes[0] & 0x80) != 0;
  const auto descriptor = wrench_descriptor();
  const UhidIdentity identity = wrench ? UhidIdentity(WrenchHidOptions{}) : SpacemouseOptions{};
  const auto creation =
      uhid_creation(identity, wrench ? Bytes(descriptor) : spacemouse_descriptor());
  bytes = changed(*creation, bytes);
  UhidGate gate;
  if (!gate.passes(as_bytes(*creation))) return;
  check_device(creation->u.create2);
  expect(!gate.neutral().empty(), "a device can be brought to rest");
  while (!bytes.empty()) {
    const Bytes event = bytes.first(std::min<std::size_t>(bytes[0], bytes.size()));
    if (gate.passes(event)) check_report(event);
    bytes = bytes.subspan(std::max<std::size_t>(event.size(), 1));
  }
}

void check_joystick(Bytes bytes) {
  uinput_setup setup = joystick_setup({});
  bytes = changed(setup, bytes);
  if (const auto lent = lent_joystick(as_bytes(setup)))
    expect(lent->id.vendor == 0x1209 && lent->ff_effects_max == 0, "a joystick is ours");
  JoystickEvents frame = joystick_events({1, -2, 3}, 5);
  changed(frame, bytes);
  if (!is_joystick_frame(as_bytes(frame))) return;
  for (const input_event& event : frame)
    expect(event.type != EV_KEY || (event.code >= BTN_JOYSTICK && event.code < BTN_GAMEPAD),
           "a joystick has no keys of a keyboard");
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t count) {
  expect(!UhidGate().passes({bytes, count}) || count == sizeof(uhid_event), "first comes a device");
  expect(!is_joystick_frame({bytes, count}) || count == sizeof(JoystickEvents), "a frame is whole");
  check_uhid({bytes, count});
  check_joystick({bytes, count});
  return 0;
}
