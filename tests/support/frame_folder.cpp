#include "tests/support/frame_folder.h"

#include <fmt/format.h>

#include <cmath>
#include <fstream>
#include <opencv2/imgcodecs.hpp>
#include <stdexcept>
#include <utility>

namespace tagwrench::test {

void write_frame_folder(const FrameFolder& what, const std::filesystem::path& folder) {
  std::string times = "file,t_ns\n";
  std::string truth =
      "seq,t_ns,dx_m,dy_m,dz_m,rx_rad,ry_rad,rz_rad,fx_n,fy_n,fz_n,mx_nm,my_nm,mz_nm\n";
  for (int i = 0; i < what.frames; ++i) {
    const Vector6 d = what.displacement(i);
    const std::string name = fmt::format("{:06}.png", i);
    const long long time = std::llround(1e9 * i / what.frame_rate);
    if (!cv::imwrite((folder / name).string(), what.picture(i), {cv::IMWRITE_PNG_COMPRESSION, 1}))
      throw std::runtime_error((folder / name).string() + ": cannot be written");
    times += fmt::format("{},{}\n", name, time);
    truth += fmt::format("{},{}", i, time);
    for (const double value : d) truth += fmt::format(",{:.9g}", value);
    truth += ",0,0,0,0,0,0\n";
  }
  for (const auto& [name, text] :
       {std::pair{"frames.csv", times}, {"truth.csv", truth}, {"sensor.yaml", what.sensor_yaml}}) {
    std::ofstream file(folder / name, std::ios::binary);
    file << text;
    if (!file.flush()) throw std::runtime_error((folder / name).string() + ": cannot be written");
  }
}

}  // namespace tagwrench::test
