// Several files that belong together: all of them are written, or none.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace tagwrench {

struct NamedText {
  std::filesystem::path path;
  std::string_view text;
};

/// Writes temporaries beside all of them, then gives them their names. What had a name before is
/// replaced if `replace`, and stays as it was if any of the files cannot be written. Throws
/// std::runtime_error, also where a file is in the way and not to be replaced.
void write_together(const std::vector<NamedText>& files, bool replace);

}  // namespace tagwrench
