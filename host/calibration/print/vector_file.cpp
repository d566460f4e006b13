#include <cairo-pdf.h>
#include <cairo-svg.h>
#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <numbers>
#include <stdexcept>

#include "host/calibration/print/drawing.h"
#include "host/core/config_error.h"
#include "host/core/os/unique_fd.h"

namespace tagwrench {
namespace {

namespace fs = std::filesystem;

constexpr double kPoint_mm = 25.4 / 72;  // PostScript's, which PDF and cairo count in

using Surface = std::unique_ptr<cairo_surface_t, decltype(&cairo_surface_destroy)>;
using Context = std::unique_ptr<cairo_t, decltype(&cairo_destroy)>;

cairo_status_t append(void* bytes, const unsigned char* data, unsigned int length) noexcept {
  try {
    static_cast<std::string*>(bytes)->append(reinterpret_cast<const char*>(data), length);
    return CAIRO_STATUS_SUCCESS;
  } catch (...) {
    return CAIRO_STATUS_NO_MEMORY;
  }
}

void fill(cairo_t* context, const Area& area) {
  for (const std::vector<PagePoint>& contour : area) {
    cairo_new_sub_path(context);
    for (const PagePoint& point : contour) cairo_line_to(context, point.x_mm, point.y_mm);
    cairo_close_path(context);
  }
  cairo_fill(context);
}

void stroke(cairo_t* context, const Line& line) {
  cairo_set_line_width(context, line.width_mm);
  cairo_move_to(context, line.from.x_mm, line.from.y_mm);
  cairo_line_to(context, line.to.x_mm, line.to.y_mm);
  cairo_stroke(context);
}

void write(cairo_t* context, const Text& text) {
  cairo_save(context);
  cairo_set_font_size(context, text.height_mm);
  cairo_translate(context, text.at.x_mm, text.at.y_mm);
  if (text.upward) cairo_rotate(context, -0.5 * std::numbers::pi);
  cairo_text_extents_t extents;
  cairo_text_extents(context, text.text.c_str(), &extents);
  cairo_move_to(context, text.anchor == TextAnchor::centre ? -0.5 * extents.x_advance : 0, 0);
  cairo_show_text(context, text.text.c_str());
  cairo_restore(context);
}

std::string render(const Drawing& drawing, bool pdf) {
  std::string bytes;
  const auto create =
      pdf ? &cairo_pdf_surface_create_for_stream : &cairo_svg_surface_create_for_stream;
  const Surface surface(
      create(&append, &bytes, drawing.width_mm / kPoint_mm, drawing.height_mm / kPoint_mm),
      &cairo_surface_destroy);
  // Without this a browser takes the numbers for pixels of 1/96 inch.
  if (!pdf) cairo_svg_surface_set_document_unit(surface.get(), CAIRO_SVG_UNIT_PT);
  const Context context(cairo_create(surface.get()), &cairo_destroy);
  cairo_scale(context.get(), 1 / kPoint_mm, 1 / kPoint_mm);
  cairo_set_source_rgb(context.get(), 0, 0, 0);
  cairo_set_fill_rule(context.get(), CAIRO_FILL_RULE_EVEN_ODD);
  cairo_select_font_face(context.get(), "monospace", CAIRO_FONT_SLANT_NORMAL,
                         CAIRO_FONT_WEIGHT_NORMAL);
  for (const Area& area : drawing.areas) fill(context.get(), area);
  for (const Line& line : drawing.lines) stroke(context.get(), line);
  for (const Text& text : drawing.texts) write(context.get(), text);
  cairo_show_page(context.get());
  cairo_surface_finish(surface.get());
  cairo_status_t status = cairo_status(context.get());
  if (status == CAIRO_STATUS_SUCCESS) status = cairo_surface_status(surface.get());
  if (status != CAIRO_STATUS_SUCCESS) {
    throw std::runtime_error(
        fmt::format("cairo cannot draw the sheet ({})", cairo_status_to_string(status)));
  }
  return bytes;
}

void write_bytes(int file, std::string_view bytes, const fs::path& path) {
  while (!bytes.empty()) {
    const ssize_t written = ::write(file, bytes.data(), bytes.size());
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) {
      throw std::runtime_error(
          fmt::format("{}: cannot be written ({}): free some space or choose another --out",
                      path.string(), std::strerror(errno)));
    }
    bytes.remove_prefix(static_cast<std::size_t>(written));
  }
}

[[noreturn]] void cannot_make(const fs::path& path, const char* why) {
  throw ConfigError(
      fmt::format("{}: cannot be made ({}): choose another --out", path.string(), why));
}

void replace_file(const fs::path& path, std::string_view bytes) {
  std::error_code error;
  const fs::file_status status = fs::status(path, error);
  if (fs::is_directory(status)) cannot_make(path, "is a folder");
  if (fs::exists(status) && !fs::is_regular_file(status)) {
    cannot_make(path, "is a pipe or a device");
  }
  std::string partial = path.string() + ".XXXXXX";
  const UniqueFd file(::mkostemp(partial.data(), O_CLOEXEC));
  if (!file) cannot_make(path, std::strerror(errno));
  try {
    write_bytes(file.get(), bytes, path);
    const mode_t mask = ::umask(0);
    ::umask(mask);
    // mkostemp's file is its owner's alone.
    if (::fchmod(file.get(), 0666 & ~mask) != 0 || ::rename(partial.c_str(), path.c_str()) != 0) {
      cannot_make(path, std::strerror(errno));
    }
  } catch (...) {
    ::unlink(partial.c_str());
    throw;
  }
}

}  // namespace

void write_vector_file(const Drawing& drawing, const fs::path& path) {
  std::string ending = path.extension().string();
  std::transform(ending.begin(), ending.end(), ending.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  if (ending != ".pdf" && ending != ".svg") {
    throw ConfigError(
        fmt::format("--out {}: is neither a .pdf nor an .svg; name it so", path.string()));
  }
  replace_file(path, render(drawing, ending == ".pdf"));
}

}  // namespace tagwrench
