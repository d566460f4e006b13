// First inputs of the fuzzers that read files: the files of this tree, and some as small as they
// can be.
#pragma once

#include <filesystem>

namespace tagwrench::fuzz {

/// Into DIR/yaml, json, tables, pictures, devices and desk. `project`: the tree's top.
void write_file_seeds(const std::filesystem::path& dir, const std::filesystem::path& project);

}  // namespace tagwrench::fuzz
