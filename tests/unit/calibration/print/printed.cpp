#include "tests/unit/calibration/print/printed.h"

#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdlib>
#include <opencv2/imgcodecs.hpp>
#include <sstream>
#include <stdexcept>
#include <vector>

#include "host/calibration/print/sheets.h"
#include "tests/support/temporary_folder.h"

extern char** environ;

namespace tagwrench::test {
namespace {

bool run(std::vector<std::string> words) {
  std::vector<char*> argv;
  for (std::string& word : words) argv.push_back(word.data());
  argv.push_back(nullptr);
  pid_t pid = 0;
  if (::posix_spawnp(&pid, argv[0], nullptr, nullptr, argv.data(), environ) != 0) return false;
  int status = 0;
  return ::waitpid(pid, &status, 0) == pid && WIFEXITED(status) && WEXITSTATUS(status) == 0;
}

}  // namespace

bool have(const std::string& program) {
  const char* path = std::getenv("PATH");
  std::istringstream folders(path == nullptr ? "" : path);
  for (std::string folder; std::getline(folders, folder, ':');) {
    if (::access((folder + "/" + program).c_str(), X_OK) == 0) return true;
  }
  return false;
}

cv::Mat rasterise(const std::filesystem::path& file, int dpi) {
  const TemporaryFolder folder;
  const std::string dots = std::to_string(dpi);
  const std::string page = folder / "page";
  const bool done =
      file.extension() == ".svg"
          ? run({"rsvg-convert", "--background-color=white", "--dpi-x=" + dots, "--dpi-y=" + dots,
                 "--output=" + page + ".png", file.string()})
          : run({"pdftoppm", "-gray", "-png", "-singlefile", "-r", dots, file.string(), page});
  return done ? cv::imread(page + ".png", cv::IMREAD_GRAYSCALE) : cv::Mat();
}

cv::Mat print(const Drawing& drawing, const std::string& ending, int dpi) {
  const TemporaryFolder folder;
  const std::filesystem::path file = folder / ("sheet" + ending);
  write_vector_file(drawing, file);
  return rasterise(file, dpi);
}

}  // namespace tagwrench::test
