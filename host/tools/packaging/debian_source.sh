#!/bin/bash
# debian_source.sh DIR SOURCE PACKAGE FILE...: puts files and folders of a Debian source package into DIR, in the version
# that PACKAGE is installed in, or the archive's where it is not. For what only sources will do: other compilers than the
# system's. Nothing is installed, apt's own lists stay as they are, an ordinary user can run it. A second call finds
# DIR/ready and returns at once. Exit status 1 with one line where they cannot be had.
set -u
[ $# -ge 4 ] || { echo "usage: debian_source.sh DIR SOURCE PACKAGE FILE..." >&2; exit 2; }
export LC_ALL=C
script=$(readlink -f "$0")
mkdir -p "$1" && dir=$(readlink -f "$1") || exit 1
source=$2
package=$3
shift 3

unavailable() {
  echo "$source's sources unavailable: $1" >&2
  exit 1
}

exec 9>"$dir/lock"
flock 9
# The sources must go with what is installed, so its version belongs to the recipe.
version=$(dpkg-query -W -f='${source:Version}' "$package" 2>/dev/null)
recipe="$(sha256sum <"$script" | cut -d' ' -f1) $* ${version:-any}"
[ "$(cat "$dir/ready" 2>/dev/null)" = "$recipe" ] && exit 0
rm -f "$dir/ready"

for need in apt-get:apt dpkg-source:dpkg-dev; do
  command -v "${need%%:*}" >/dev/null || unavailable "install the Debian package ${need#*:}"
done

work=$dir/work
log=$dir/fetch.log
rm -rf "$work"
mkdir -p "$work/parts" "$work/lists/partial" "$work/cache/archives/partial" || exit 1
trap 'rm -rf "$work"' EXIT
: >"$log"

# The machine's own package sources, asked for source packages instead of binary ones; both formats that apt knows.
for list in /etc/apt/sources.list /etc/apt/sources.list.d/*.list; do
  [ -r "$list" ] || continue
  sed -nE 's/^[[:space:]]*deb(-src)?[[:space:]]+/deb-src /p' "$list" | sort -u >"$work/parts/$(basename "$list" .list).list"
done
for list in /etc/apt/sources.list.d/*.sources; do
  [ -r "$list" ] || continue
  sed -E 's/^types:.*/Types: deb-src/I' "$list" >"$work/parts/$(basename "$list")"
done

apt=(apt-get -q -o Dir::Etc::SourceList=/dev/null -o "Dir::Etc::SourceParts=$work/parts" -o "Dir::State::Lists=$work/lists"
  -o "Dir::Cache=$work/cache" -o APT::Sandbox::User=root)
cd "$work" || exit 1
# A package source of others may have no source packages, which update calls an error; what counts is the next step.
"${apt[@]}" update >>"$log" 2>&1 || true
# The archive may have replaced the installed version by a newer one.
"${apt[@]}" source --download-only "$source${version:+=$version}" >>"$log" 2>&1 ||
  "${apt[@]}" source --download-only "$source" >>"$log" 2>&1 ||
  unavailable "apt-get cannot fetch the source package $source (see $log)"
dpkg-source --extract "$source"_*.dsc unpacked >>"$log" 2>&1 || unavailable "cannot unpack the source package (see $log)"
for file in "$@"; do
  rm -rf "${dir:?}/$file"
  cp -r "unpacked/$file" "$dir/$file" || unavailable "the source package has no $file"
done
echo "$recipe" >"$dir/ready"
