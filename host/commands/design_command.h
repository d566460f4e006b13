// `tagwrench design`: its options, and from them what the instrument would measure.
#pragma once

#include <string>
#include <vector>

#include "host/core/command_line/command_line.h"
#include "host/tools/design/design.h"
#include "host/tracker/target.h"

namespace tagwrench {

/// Declares itself on the command line; must outlive the parsing.
class DesignCommand {
 public:
  explicit DesignCommand(command_line::Command program);

  bool parsed() const { return verb_.parsed(); }
  /// Prints the report; returns the exit status. Throws ConfigError for what cannot be built.
  int run() const;

 private:
  void add_picture_options();
  void add_tag_options();
  void add_spring_options();
  void take_sensor(study::Instrument& instrument) const;
  /// A tag counts as wide as if it faced the lens, the image as the rectangle around the papers.
  void take_target(const TargetDescription& target, const Eigen::Isometry3d& rest,
                   study::Instrument& instrument) const;
  void place_tags(study::Instrument& instrument) const;
  void mount_springs(study::Instrument& instrument) const;
  study::Instrument instrument() const;

  command_line::Command verb_;
  command_line::Option range_given_;
  command_line::Option tag_px_given_;
  command_line::Option distance_given_;
  command_line::Option size_given_;
  command_line::Option paper_given_;
  command_line::Option camera_given_;
  command_line::Option image_given_;
  command_line::Option axial_given_;
  command_line::Option lateral_given_;
  std::string sensor_;
  std::string hardware_;
  std::string check_;
  std::string export_;
  bool force_ = false;
  std::string camera_ = "640x480";
  double fps_ = 25;
  double lens_distance_mm_ = 21;
  double tag_mm_ = 3.8;
  double tag_with_border_mm_ = 4.5;
  double tag_px_ = 150;
  std::string image_ = "150x240";
  double counts_per_px_ = 4;
  double blur_px_ = 1.5;
  double noise_counts_ = 2;
  double contrast_counts_ = 170;
  std::string family_ = "aruco_original";
  std::vector<int> ids_{5, 2};
  double range_n_ = 1;
  double axial_n_per_mm_ = 0.7;
  double lateral_n_per_mm_ = 0.07;
  double spring_length_mm_ = 25.4;
  double spring_width_mm_ = 4.75;
  double wire_mm_ = 0.71;
  double coils_ = 0;
  double spacing_x_mm_ = 15;
  double spacing_y_mm_ = 13;
  double mass_g_ = 10;
  std::vector<double> inertia_g_mm2_{1000, 1300, 2000};
  double mass_height_mm_ = 4;
  std::vector<double> ranges_{1, 2, 5, 10, 20, 40};
};

}  // namespace tagwrench
