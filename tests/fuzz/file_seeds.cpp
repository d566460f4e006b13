#include "tests/fuzz/file_seeds.h"

#include <array>
#include <cmath>
#include <fstream>
#include <iterator>
#include <opencv2/imgcodecs.hpp>
#include <string>
#include <vector>

#include "host/core/png/png.h"
#include "host/motion/focus_watch.h"
#include "host/sensor/calibration_file.h"
#include "host/sensor/measured_files.h"

namespace tagwrench::fuzz {
namespace {

namespace fs = std::filesystem;
using Bytes = std::vector<std::uint8_t>;

/// The byte that chooses the reader, and what it reads.
void write(const fs::path& path, int kind, const std::string& text) {
  fs::create_directories(path.parent_path());
  std::ofstream file(path, std::ios::binary);
  file << static_cast<char>(kind) << text;
  file.close();
  if (!file) throw std::runtime_error("cannot write " + path.string());
}

std::string text_of(const fs::path& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

void write_all_in(const fs::path& to, int kind, const fs::path& folder) {
  for (const auto& entry : fs::directory_iterator(folder))
    if (entry.path().extension() == ".yaml")
      write(to / (std::to_string(kind) + entry.path().filename().string()), kind,
            text_of(entry.path()));
}

/// In the order of yaml_files.cpp's readers.
void write_yaml(const fs::path& to, const fs::path& project) {
  write(to / "0sensor", 0,
        "camera: {width: 640, height: 480, fx: 805, fy: 805, cx: 319.5, cy: 239.5}\n"
        "target: {family: aruco_original, tag_size_mm: 6, tags: [{id: 5}, {id: 2}]}\n"
        "rest: {frames: 20}\n"
        "wrench:\n  springs:\n    centres_mm: [[1, 1, 0], [-1, 1, 0], [-1, -1, 0], [1, -1, 0]]\n"
        "    axial_n_per_mm: 1\n    lateral_n_per_mm: 1\n    bending_nm_per_rad: 1\n"
        "    torsion_nm_per_rad: 1\n  range_n: [1, 1, 1]\n  range_nm: [1, 1, 1]\n");
  write_all_in(to, 1, project / "host/motion/profiles");
  write_all_in(to, 2, project / "host/calibration/wrench/plans");
  write_all_in(to, 3, project / "tests/sim/scenarios");
  write_all_in(to, 4, project / "hardware/sensors");
  CameraFile camera;
  camera.camera.width_px = 640;
  camera.camera.height_px = 480;
  camera.camera.fx_px = camera.camera.fy_px = 805;
  write(to / "5camera", 5, camera_yaml(camera, "camera"));
  TargetFile target;
  target.target.tag_size = 6e-3;
  target.target.tags.clear();
  for (const int id : {5, 2}) {
    Tag tag;
    tag.id = id;
    tag.platform_T_tag = Eigen::Isometry3d::Identity();
    target.target.tags.push_back(tag);
  }
  target.picture = PictureName{"rest.png", std::string(64, '0'), 20};
  target.readout = 0.018;
  write(to / "6target", 6, target_yaml(target));
  write(to / "7zero", 7, zero_yaml({}));
  // Found once: Eigen's comma asserted where the second list was refused.
  write(to / "7zero_half", 7, "format: tagwrench-zero-1\nzero_n: [1, 2, 3]\nzero_nm: [1]\n");
}

void write_json(const fs::path& to) {
  Calibration calibration;
  calibration.sensor.family = "aruco_original";
  calibration.sensor.tag_ids = {5, 2};
  calibration.sensor.tag_size_mm = 6;
  calibration.sensor.image_px = {640, 480};
  calibration.sensor.lens_px = {805, 805, 319.5, 239.5};
  calibration.model.K = 100 * Matrix6::Identity();
  calibration.model.range.setOnes();
  write(to / "calibration", 0, calibration_text(calibration));
  write(
      to / "cells", 1,
      R"({"format":"tagwrench-cells-1","board":"5457","cells":[{"channel":0,)"
      R"("newtons_per_count":1e-5,"newtons_per_count_sigma":1e-8,"zero_counts":100,)"
      R"("zero_sigma_counts":2,"zero_scale_covariance_n":0,"noise_counts":30,"residual_n":0.01}]})");
  write(to / "progress", 2,
        R"({"format":"tagwrench-progress-1","plan_sha256":"a","sensor_sha256":"b","skipped":[],)"
        R"("records":[{"step":0,"zero":0,"frames":[],"readings":[]}]})");
}

void write_tables(const fs::path& to) {
  std::string trial =
      "# tagwrench-data-1\n# name: a\nkind,t_s,x_m,y_m,z_m,rx_rad,ry_rad,rz_rad,"
      "Fx_N,Fy_N,Fz_N,Mx_Nm,My_Nm,Mz_Nm\n";
  for (int i = 0; i < 6; ++i) {
    trial += "reading,0." + std::to_string(i) + "1,0,0,0.001,0,0,0,,,,,,\n";
    trial += "reference,0." + std::to_string(i) + "2,,,,,,,1,2,3,0.1,0.2,0.3\n";
  }
  write(to / "trial", 0, trial);
  // Found once: a column without a name could be read and not be written.
  write(to / "unnamed", 0,
        "# tagwrench-data-1\nkind,t_s,x_m,,z_m,Fx_N,Fy_N,Fz_N,Mx_Nm,My_Nm,Mz_Nm\n");
  write(to / "others", 1, "2-7:mm;8-13:N\nt,a,b,c,d,e,f,g\n0,1,2,3,4,5,6,7\n1,1,2,3,4,5,6,7\n");
  write(to / "times", 2, "file,t_ns\n000000.png,0\n000001.png,40000000\nb.jpg,80000000\n");
  write(to / "hex", 3, ":100000000C9434000C9446000C9446000C9446006A\n:00000001FF\n");
}

/// A square and a gradient, in every format that pictures.cpp tries.
void write_pictures(const fs::path& to) {
  constexpr int kWidth = 64, kHeight = 48;
  cv::Mat grey(kHeight, kWidth, CV_8U);
  std::vector<std::uint16_t> counts;
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      grey.at<std::uint8_t>(y, x) = static_cast<std::uint8_t>(x > 20 && y > 10 ? 200 : x + y);
      counts.push_back(static_cast<std::uint16_t>(256 * (x + y)));
    }
  }
  const auto picture = [&](const char* name, int format, const Bytes& bytes) {
    write(to / name, format, std::string(1, '\0') + std::string(bytes.begin(), bytes.end()));
  };
  Bytes file;
  cv::imencode(".jpg", grey, file);
  picture("jpeg", 0, file);
  cv::imencode(".jpg", grey, file, {cv::IMWRITE_JPEG_RST_INTERVAL, 4});
  picture("jpeg_restarts", 0, file);
  cv::imencode(".jpg", grey, file, {cv::IMWRITE_JPEG_PROGRESSIVE, 1});
  picture("jpeg_progressive", 0, file);
  cv::Mat colours;
  cv::merge(std::vector<cv::Mat>{grey, grey, 255 - grey}, colours);
  cv::imencode(".jpg", colours, file);
  picture("jpeg_colours", 0, file);
  picture("png", 1, encode_png(grey.data, kWidth, kHeight));
  picture("png16", 1, encode_png(counts.data(), kWidth, kHeight));
  cv::imencode(".pgm", grey, file);
  picture("pgm", 2, file);
  const std::string plain = "P2\n64 48\n255\n" + [] {
    std::string numbers;
    for (int i = 0; i < kWidth * kHeight; ++i) numbers += std::to_string(i % 256) + " ";
    return numbers;
  }();
  picture("pgm_plain", 2, Bytes(plain.begin(), plain.end()));
  const Bytes pixels(grey.data, grey.data + kWidth * kHeight);
  picture("grey", 3, pixels);
  Bytes twice = pixels;
  twice.insert(twice.end(), pixels.begin(), pixels.end());
  for (const auto& [name, format] : {std::pair{"nv12", 4}, {"yuyv", 5}, {"uyvy", 6}})
    picture(name, format, twice);
}

void write_devices(const fs::path& to) {
  const Bytes descriptor{0x06, 0x00, 0xff, 0x09, 0x10, 0xa1, 0x01, 0x85, 0x20,
                         0x95, 0x3f, 0x75, 0x08, 0x09, 0x20, 0x81, 0x02, 0xc0};
  write(to / "descriptor", descriptor[0], std::string(descriptor.begin() + 1, descriptor.end()));
  write(to / "report", 0x20, std::string(63, '\0'));
  write(to / "inputs", 'I',
        ": Bus=0003 Vendor=256f Product=c635 Version=0111\nN: Name=\"3Dconnexion SpaceMouse\"\n\n");
}

void write_desk(const fs::path& to) {
  const std::string tree =
      R"({"focused":false,"nodes":[{"focused":true,"app_id":"org.blender.Blender","nodes":[]}]})";
  const std::string event =
      R"({"change":"focus","container":{"window_properties":{"class":"FreeCAD"}}})";
  write(to / "i3", 0, i3_message(I3Type::tree, tree) + i3_message(I3Type::window_event, event));
  write(to / "tree", 1, tree);
  write(to / "event", 1, event);
  write(to / "try", 2, "try my game\nlock: none\ntranslation: 1\n");
  write(to / "live", 2, "ok: ok 0 0 0 0 0 0 0 0 0 0 0 0 0 0\n");
  write(to / "job", 3,
        "{\"event\":\"progress\",\"fraction\":0.5}\n{\"event\":\"picture\",\"width\":64,"
        "\"height\":48,\"tags\":[],\"jpeg\":\"/9j/\"}\n");
}

}  // namespace

void write_file_seeds(const fs::path& dir, const fs::path& project) {
  write_yaml(dir / "yaml", project);
  write_json(dir / "json");
  write_tables(dir / "tables");
  write_pictures(dir / "pictures");
  write_devices(dir / "devices");
  write_desk(dir / "desk");
}

}  // namespace tagwrench::fuzz
