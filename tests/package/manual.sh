#!/bin/bash
# manual.sh FOLDER: man reads every page in FOLDER without a warning, and each has a name that apropos finds.
set -eu
command -v man > /dev/null || { echo "man pages are not read: install man-db"; exit 77; }
export MANWIDTH=80 LC_ALL=C.UTF-8
pages=0
for page in "$1"/*.1.gz; do
  said=$(man --warnings -E UTF-8 -l -Tutf8 -Z "$page" 2>&1 > /dev/null)
  [ -z "$said" ] || { echo "$page: $said"; exit 1; }
  lexgrog "$page" > /dev/null || { echo "$page: its name cannot be read"; exit 1; }
  pages=$((pages + 1))
done
[ "$pages" -gt 20 ] || { echo "only $pages man pages"; exit 1; }
echo "$pages man pages"
