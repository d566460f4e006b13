// A folder that goes with the test.
#pragma once

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string>

namespace tagwrench::test {

class DoctorFolder {
 public:
  DoctorFolder() {
    std::string name = (std::filesystem::temp_directory_path() / "tw-doctor-XXXXXX").string();
    if (::mkdtemp(name.data()) == nullptr) throw std::runtime_error("mkdtemp");
    path_ = name;
  }
  DoctorFolder(const DoctorFolder&) = delete;
  DoctorFolder& operator=(const DoctorFolder&) = delete;
  ~DoctorFolder() { std::filesystem::remove_all(path_); }

  std::filesystem::path operator/(const std::string& name) const { return path_ / name; }
  void write(const std::string& name, const std::string& text) const {
    std::filesystem::create_directories((path_ / name).parent_path());
    std::ofstream(path_ / name) << text;
  }

 private:
  std::filesystem::path path_;
};

}  // namespace tagwrench::test
