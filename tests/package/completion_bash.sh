#!/bin/bash
# completion_bash.sh PROGRAM SCRIPT: what bash offers after the words of a command line. The last word is up to the cursor.
set -u
framework=/usr/share/bash-completion/bash_completion
[ -e "$framework" ] || { echo "completion in bash is not tested: install bash-completion"; exit 77; }
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
ln -s "$1" "$folder/tagwrench"
touch "$folder/push.twr" "$folder/my sensor.yaml"
PATH=$folder:$PATH
cd "$folder" || exit 1
. "$framework"
. "$2"
# shellcheck disable=SC2317  # called by what was read in
compopt() { :; }  # bash has it only while a user types
failed=0

offers() { # EXPECTED WORD...; bash takes a colon for a word of its own
  local expected=$1 COMP_WORDS COMP_CWORD COMP_LINE COMP_POINT COMPREPLY=()
  shift
  COMP_WORDS=(tagwrench "$@") COMP_CWORD=$# COMP_LINE="tagwrench $*"
  COMP_LINE=${COMP_LINE// : /:}
  COMP_POINT=${#COMP_LINE}
  _tagwrench
  local got
  got=$(IFS='|'; echo "${COMPREPLY[*]-}")
  [ "$got" = "$expected" ] || { echo "after '$*' it offers '$got', not '$expected'"; failed=1; }
}

offers 'calibrate' cali
offers 'camera|target|wrench' calibrate ''
offers '--source' run --sou
offers 'sim|sim:' run --source s
offers 'jsonl:' run --output js
offers 'wrench' run --output wr
offers 'push.twr' run --source recording : pu
offers 'cad' run --profile ca
offers 'my sensor.yaml' run --sensor my
offers '' run --frames ''
[ "$failed" -eq 0 ] && echo "completion in bash: ok"
exit "$failed"
