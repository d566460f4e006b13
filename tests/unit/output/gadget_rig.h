// What the gadget tests have in common: a folder in the kernel's place.
#pragma once

#include <gtest/gtest.h>
#include <stdlib.h>

#include <filesystem>
#include <fstream>
#include <string>

#include "tests/support/temporary_folder.h"

namespace tagwrench::test {

class TemporaryTree {
 public:
  std::string operator/(const std::string& below) const { return path_ + "/" + below; }
  const std::string& path() const { return path_; }

 private:
  test::TemporaryFolder temporary_;
  std::string path_ = temporary_.path();
};

inline void put_text(const std::string& path, const std::string& text) {
  std::filesystem::create_directories(std::filesystem::path(path).parent_path());
  std::ofstream(path) << text;
}

}  // namespace tagwrench::test
