// What the gadget tests have in common: a folder in the kernel's place.
#pragma once

#include <gtest/gtest.h>
#include <stdlib.h>

#include <filesystem>
#include <fstream>
#include <string>

namespace test {

class TemporaryTree {
 public:
  TemporaryTree() {
    std::string pattern = testing::TempDir() + "tagwrench-gadget-XXXXXX";
    path_ = ::mkdtemp(pattern.data());
  }
  ~TemporaryTree() { std::filesystem::remove_all(path_); }
  std::string operator/(const std::string& below) const { return path_ + "/" + below; }
  const std::string& path() const { return path_; }

 private:
  std::string path_;
};

inline void put_text(const std::string& path, const std::string& text) {
  std::filesystem::create_directories(std::filesystem::path(path).parent_path());
  std::ofstream(path) << text;
}

}  // namespace test
