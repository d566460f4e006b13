// JPEGs of every kind that a camera or a folder may bring, made on the spot by libjpeg.
#pragma once

#include <cstddef>
#include <cstdio>
// clang-format off
#include <jpeglib.h>
// clang-format on

#include <cstdlib>
#include <string>

#include "tests/unit/source/jpeg_fixture.h"

namespace tagwrench {

struct JpegKind {
  std::string name;
  int components = 3;
  int h = 1, v = 1;  ///< sampling factors of luminance; chrominance has 1 x 1
  int chroma_h = 1, chroma_v = 1;
  bool progressive = false;
  bool arithmetic = false;
  bool one_scan_per_component = false;
  int restart_in_mcus = 0;
  int restart_in_rows = 0;
  bool rgb = false;  ///< stored as RGB
};

inline std::vector<JpegKind> jpeg_kinds() {
  return {
      {.name = "grey", .components = 1},
      {.name = "grey with odd factors", .components = 1, .h = 2, .v = 2},
      {.name = "4:4:4"},
      {.name = "4:2:2", .h = 2},
      {.name = "4:2:0", .h = 2, .v = 2},
      {.name = "4:4:0", .v = 2},
      {.name = "4:1:1", .h = 4},
      {.name = "4:2:2 restart", .h = 2, .restart_in_mcus = 5},
      {.name = "4:2:0 restart", .h = 2, .v = 2, .restart_in_mcus = 1},
      {.name = "4:2:0 restart every row", .h = 2, .v = 2, .restart_in_rows = 1},
      {.name = "4:2:2 restart every third row", .h = 2, .restart_in_rows = 3},
      {.name = "grey restart", .components = 1, .restart_in_rows = 1},
      {.name = "grey restart, odd factors", .components = 1, .h = 2, .v = 2, .restart_in_rows = 1},
      {.name = "4:4:4 restart anywhere", .restart_in_mcus = 7},
      {.name = "scans restart", .one_scan_per_component = true, .restart_in_rows = 1},
      {.name = "arithmetic restart", .arithmetic = true, .restart_in_rows = 1},
      {.name = "grey progressive", .components = 1, .progressive = true},
      {.name = "4:2:0 progressive", .h = 2, .v = 2, .progressive = true},
      {.name = "4:2:2 progressive restart", .h = 2, .progressive = true, .restart_in_mcus = 3},
      {.name = "4:2:0 arithmetic", .h = 2, .v = 2, .arithmetic = true},
      {.name = "4:2:2 arithmetic progressive", .h = 2, .progressive = true, .arithmetic = true},
      {.name = "4:2:0 scans", .h = 2, .v = 2, .one_scan_per_component = true},
      {.name = "RGB", .rgb = true},
  };
}

/// Luminance as given; the colours vary too, so that their bits are not trivial.
inline std::vector<std::uint8_t> jpeg_of_kind(const JpegKind& kind,
                                              const std::vector<std::uint8_t>& luma, int width,
                                              int height) {
  jpeg_compress_struct jpeg{};
  jpeg_error_mgr errors{};
  jpeg.err = jpeg_std_error(&errors);
  jpeg_create_compress(&jpeg);
  unsigned char* data = nullptr;
  unsigned long size = 0;
  jpeg_mem_dest(&jpeg, &data, &size);
  jpeg.image_width = static_cast<JDIMENSION>(width);
  jpeg.image_height = static_cast<JDIMENSION>(height);
  jpeg.input_components = kind.components;
  jpeg.in_color_space = kind.components == 1 ? JCS_GRAYSCALE : kind.rgb ? JCS_RGB : JCS_YCbCr;
  jpeg_set_defaults(&jpeg);
  jpeg_set_colorspace(&jpeg, jpeg.in_color_space);
  jpeg_set_quality(&jpeg, 85, TRUE);
  for (int i = 0; i < kind.components; ++i) {
    jpeg.comp_info[i].h_samp_factor = i == 0 ? kind.h : kind.chroma_h;
    jpeg.comp_info[i].v_samp_factor = i == 0 ? kind.v : kind.chroma_v;
  }
  jpeg.restart_interval = static_cast<unsigned>(kind.restart_in_mcus);
  jpeg.restart_in_rows = kind.restart_in_rows;
  jpeg.arith_code = kind.arithmetic ? TRUE : FALSE;
  const jpeg_scan_info scans[] = {
      {1, {0}, 0, 63, 0, 0}, {1, {1}, 0, 63, 0, 0}, {1, {2}, 0, 63, 0, 0}};
  if (kind.one_scan_per_component) {
    jpeg.scan_info = scans;
    jpeg.num_scans = 3;
  }
  if (kind.progressive) jpeg_simple_progression(&jpeg);
  jpeg_start_compress(&jpeg, TRUE);
  std::vector<std::uint8_t> row;
  for (int y = 0; y < height; ++y) {
    row.clear();
    for (int x = 0; x < width; ++x) {
      row.push_back(luma[static_cast<std::size_t>(y * width + x)]);
      if (kind.components == 1) continue;
      row.push_back(static_cast<std::uint8_t>(128 + (x * 7 + y) % 60));
      row.push_back(static_cast<std::uint8_t>(128 - (x + y * 5) % 70));
    }
    JSAMPROW samples = row.data();
    jpeg_write_scanlines(&jpeg, &samples, 1);
  }
  jpeg_finish_compress(&jpeg);
  std::vector<std::uint8_t> out(data, data + size);
  jpeg_destroy_compress(&jpeg);
  std::free(data);
  return out;
}

}  // namespace tagwrench
