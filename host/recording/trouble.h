// Why a recording cannot be written any more, in words for people.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "host/recording/database.h"

namespace tagwrench::record {

/// One line: what happened to the file, `kept` (what of it is there), and what to do. Where it
/// could not grow it says what kept it from that: the disk, a quota, or a limit on file sizes.
std::string write_trouble(const std::filesystem::path& path, const DatabaseError& error,
                          std::string_view kept);

}  // namespace tagwrench::record
