// The folder measured/ beside a sensor.yaml: what the program found out about this sensor, one file
// for each kind of measurement. What is there wins over what sensor.yaml says; hashes bind each
// file to what it rests on.
#pragma once

#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "host/core/types.h"
#include "host/tracker/camera_model.h"
#include "host/tracker/target.h"
#include "host/wrench/estimate.h"

namespace tagwrench {

inline constexpr const char* kMeasuredFolder = "measured";
inline constexpr const char* kMeasuredCamera = "camera.yaml";
inline constexpr const char* kMeasuredTarget = "target.yaml";
inline constexpr const char* kMeasuredPicture = "rest.png";
inline constexpr const char* kMeasuredWrench = "wrench.json";
inline constexpr const char* kMeasuredZero = "zero.yaml";
/// All that is read of the folder.
inline constexpr std::array<const char*, 5> kMeasuredFiles = {
    kMeasuredCamera, kMeasuredTarget, kMeasuredPicture, kMeasuredWrench, kMeasuredZero};
/// What was in a file before the last measurement, beside it.
inline constexpr const char* kBefore = ".before";

/// The folder of this sensor.yaml; beside the file itself where `sensor` is a link to it.
std::filesystem::path measured_folder(const std::filesystem::path& sensor);

bool is_measured(const std::filesystem::path& folder, const char* file);

/// When, by which program, for which sensor.yaml (its name alone).
struct MeasuredStamp {
  std::string date;      ///< YYYY-MM-DD; empty: not told
  std::string software;  ///< "tagwrench 0.1.0"
  std::string sensor;
};

/// camera.yaml: ROS's camera_info as camera_calibration_parsers reads and writes it, of the image
/// as the camera delivers it. What is ours alone stands below the key `tagwrench`.
struct CameraFile {
  CameraModel camera;            ///< without readout
  std::optional<bool> mirrored;  ///< not told by other programs' files
  int views = 0;
  double rms_px = 0;  ///< reprojection error
  MeasuredStamp stamp;
};

struct PictureName {
  std::string file;
  std::string sha256;
  int frames = 1;  ///< averaged
};

/// target.yaml
struct TargetFile {
  MeasuredStamp stamp;
  TargetDescription target;  ///< family, tag size, places
  Eigen::Isometry3d rest = Eigen::Isometry3d::Identity();
  std::string camera_sha256;  ///< sha256_of() the camera that saw it
  std::optional<PictureName> picture;
  std::optional<double> readout;  ///< s, where the measurement tells that the shutter rolls
};

/// zero.yaml
struct ZeroFile {
  MeasuredStamp stamp;
  Vector6 zero = Vector6::Zero();  ///< about the platform's origin, camera axes, N and N m
  std::string sensor_sha256;       ///< sha256_of() the sensor's identity
  std::string wrench_sha256;       ///< sha256_of() the model
};

/// Each throws ConfigError, "file:line: key: what is wrong and what to do".
CameraFile read_camera_file(const std::filesystem::path& file);
TargetFile read_target_file(const std::filesystem::path& file);
ZeroFile read_zero_file(const std::filesystem::path& file);

struct MeasuredPicture {
  ReferenceImage image;
  bool before = false;  ///< it lies in NAME.before: a measurement ended between its files
};

/// The picture that target.yaml names, or, where that is another one, the picture before it: a
/// measurement may have ended between the two. Throws ConfigError.
MeasuredPicture read_measured_picture(const std::filesystem::path& folder, const PictureName& name,
                                      const CameraModel& camera);

/// Throws ConfigError where the stamp tells that another sensor.yaml of the same folder is meant.
void check_owner(const std::filesystem::path& file, const MeasuredStamp& stamp,
                 const std::filesystem::path& sensor);

std::string camera_yaml(const CameraFile& camera, const std::string& name);
std::string target_yaml(const TargetFile& target);
std::string zero_yaml(const ZeroFile& zero);

/// Throws ConfigError unless these files of the folder, which need not exist, can be written.
void check_measurable(const std::filesystem::path& folder, const std::vector<const char*>& files);

/// Replaces the file as a whole, makes the folder where there is none, and keeps what was in the
/// file as NAME.before. Throws std::runtime_error; then the file is as it was.
void write_measured(const std::filesystem::path& file, std::string_view text);

/// The picture and the target that names it; at every moment one pair of the two fits. Names and
/// hashes the picture in `target`. Throws as write_measured().
void write_measured_target(const std::filesystem::path& folder, TargetFile target,
                           const ReferenceImage& picture);

/// Renames the file to NAME.before, if it is there.
void set_aside(const std::filesystem::path& file);

// What the sensor looks like at rest, as a picture file: 16-bit grey PNG, 256 counts for each grey
// level, the size of the camera's frames, under any name. The number of frames that it averages is
// sensor.yaml's rest.frames.

inline constexpr float kReferenceCountsPerLevel = 256.0F;

/// Leaves `frames` at zero. Throws ConfigError, one line with path and remedy: no such file, no
/// PNG, damaged, not 16-bit grey, not of the camera's size.
ReferenceImage load_reference_image(const std::filesystem::path& path, const CameraModel& camera);

/// The bytes of the file. Throws std::invalid_argument for an image whose size and levels do not
/// agree.
std::string encode_reference_image(const ReferenceImage& image);

// Which sensor a calibration was made with: camera, target, and how the target looks at rest.

struct SensorIdentity {
  std::string family;
  std::vector<int> tag_ids;
  double tag_size_mm = 0;
  std::array<int, 2> image_px{};
  // Absent in calibrations of older versions:
  std::optional<std::array<double, 4>> lens_px;  ///< fx fy cx cy
  std::string target_sha256;  ///< of all that `tagwrench calibrate target` finds; empty: absent
};

/// target_sha256 is taken over a text of fixed form, one line each: family, tag size, ids and,
/// where they are known, places of the tags (um and urad) and rest pose; then the picture at rest,
/// 16 bits a pixel.
SensorIdentity identity_of(const CameraModel& camera, const TargetDescription& target,
                           const ReferenceOptions& rest);

/// What differs, for people: "its tag_ids is [5,3], sensor.yaml has [5,2]"; empty if nothing does.
/// What one of them does not know does not differ.
std::string difference(const SensorIdentity& its, const SensorIdentity& ours);

/// One name for all of it: equal for data of one sensor, camera and target unchanged.
std::string sha256_of(const SensorIdentity& identity);

/// Of what the camera shows: size, lens, mirroring; not of its timing.
std::string sha256_of(const CameraModel& camera);

/// Of stiffness and offset, to six digits.
std::string sha256_of(const WrenchModel& model);

}  // namespace tagwrench
