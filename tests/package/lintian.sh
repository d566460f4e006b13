#!/bin/sh
# lintian.sh FOLDER: Debian's own checker finds no error and nothing to warn of in the packages.
command -v lintian > /dev/null || { echo "lintian was not asked: install lintian"; exit 77; }
lintian --allow-root --fail-on error,warning "$1"/*.deb
