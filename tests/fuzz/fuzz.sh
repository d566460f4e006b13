#!/bin/sh
# fuzz.sh SECONDS FUZZER FINDINGS CORPUS SEEDS: runs a fuzzer for so long. Exit status other than 0: it found something,
# which lies in FINDINGS, or was killed because it did not come to its end.
seconds=$1 fuzzer=$2 findings=$3 corpus=$4 seeds=$5
# clang 14's sanitizers stumble over the randomised layout of newer kernels; a container may not allow to fix it.
fixed=
setarch -R true 2>/dev/null && fixed="setarch -R"
exec $fixed timeout -s KILL $((seconds + 60)) "$fuzzer" -max_total_time="$seconds" -timeout=10 -rss_limit_mb=1024 \
  -print_final_stats=1 -artifact_prefix="$findings/" "$corpus" "$seeds"
