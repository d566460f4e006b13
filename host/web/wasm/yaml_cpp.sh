#!/bin/bash
# yaml_cpp.sh DIR: puts the sources of yaml-cpp into DIR: Debian has the library for its own machines, the core compiles it
# for web pages, so that a sensor.yaml gets the same words in both. See host/tools/packaging/debian_source.sh.
[ $# -eq 1 ] || { echo "usage: yaml_cpp.sh DIR" >&2; exit 2; }
exec "$(dirname "$(readlink -f "$0")")/../../tools/packaging/debian_source.sh" "$1" yaml-cpp libyaml-cpp-dev src include LICENSE
