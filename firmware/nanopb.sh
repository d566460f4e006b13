#!/bin/bash
# nanopb.sh DIR: puts nanopb's runtime sources, which the board's firmware compiles, into DIR: pb.h, pb_common.c and so
# on, from Debian's source package (the library package has no sources), in the version of the generator; pb.h checks
# whether they go together. See host/tools/packaging/debian_source.sh.
[ $# -eq 1 ] || { echo "usage: nanopb.sh DIR" >&2; exit 2; }
exec "$(dirname "$(readlink -f "$0")")/../host/tools/packaging/debian_source.sh" "$1" nanopb nanopb \
  pb.h pb_common.h pb_common.c pb_encode.h pb_encode.c pb_decode.h pb_decode.c LICENSE.txt
