#!/bin/sh
# installed.sh BUILD SOURCE CC: installs the client library alone into a folder, and builds its C example against that as a
# user of the package does, with pkg-config and with CMake. Runs both: without a sensor each ends with status 2 and one line.
set -eu
build=$1 source=$2 cc=$3
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
for component in library client; do
  cmake --install "$build" --component "$component" --prefix "$folder/root" >/dev/null
done
metadata=$(find "$folder/root" -name tagwrench-hid.pc -printf '%h')
library=$(dirname "$metadata")
export PKG_CONFIG_PATH="$metadata" LD_LIBRARY_PATH="$library"

# shellcheck disable=SC2046  # options, each a word
"$cc" "$source/host/tools/reading/examples/read_wrench.c" $(pkg-config --cflags --libs tagwrench-hid) -o "$folder/by_pkg_config"
readelf -d "$folder/by_pkg_config" | grep -q 'libtagwrench-hid\.so\.0'

mkdir "$folder/project"
cat > "$folder/project/CMakeLists.txt" <<PROJECT
cmake_minimum_required(VERSION 3.25)
project(user LANGUAGES C)
find_package(tagwrench-hid REQUIRED)
add_executable(by_cmake $source/host/tools/reading/examples/read_wrench.c)
target_link_libraries(by_cmake PRIVATE tagwrench::hid)
PROJECT
cmake -S "$folder/project" -B "$folder/made" -DCMAKE_PREFIX_PATH="$folder/root" >/dev/null
cmake --build "$folder/made" >/dev/null

# C++ may include the header, too.
printf '#include <tagwrench_hid.h>\nint main() { return tagwrench_missing(1, 2); }\n' > "$folder/user.cpp"
# shellcheck disable=SC2046
"$cc" -x c++ -Wall -Wextra -Werror "$folder/user.cpp" $(pkg-config --cflags --libs tagwrench-hid) -o "$folder/by_cpp"
"$folder/by_cpp"

for program in "$folder/by_pkg_config" "$folder/made/by_cmake"; do
  status=0
  said=$("$program" no-such-serial 2>&1) || status=$?
  [ "$status" -eq 2 ] || { echo "$program: status $status: $said"; exit 1; }
  [ "$(echo "$said" | wc -l)" -eq 1 ] || { echo "$program: more than one line: $said"; exit 1; }
done
echo "library, header, pkg-config and CMake: ok"
