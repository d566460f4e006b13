#include "host/output/gadget_face.h"

#include "host/output/hid_report.h"

namespace tagwrench {

std::string_view face_name(GadgetFace face) noexcept {
  return face == GadgetFace::spacemouse ? "spacemouse" : "wrench";
}

std::optional<GadgetFace> face_of(std::string_view name) noexcept {
  for (const GadgetFace face : {GadgetFace::spacemouse, GadgetFace::wrench}) {
    if (face_name(face) == name) return face;
  }
  return {};
}

std::string_view face_product(GadgetFace face) noexcept {
  return face == GadgetFace::spacemouse ? "SpaceMouse" : "wrench sensor";
}

UsbId face_id(GadgetFace face) noexcept {
  constexpr UsbId kSpacemouse{0x256f, 0xc62e};
  constexpr UsbId kWrench{0x1209, 0x7a6e};
  return face == GadgetFace::spacemouse ? kSpacemouse : kWrench;
}

std::vector<std::uint8_t> face_descriptor(GadgetFace face) {
  if (face == GadgetFace::wrench) return wrench_descriptor();
  const auto bytes = spacemouse_descriptor();
  return {bytes.begin(), bytes.end()};
}

std::size_t face_report_length(GadgetFace face) noexcept {
  return face == GadgetFace::spacemouse ? SpacemouseReport().size() : kWrenchReportSize;
}

}  // namespace tagwrench
