#!/bin/sh
# completion_zsh.sh PROGRAM SCRIPT: types into a real zsh on a terminal, presses Tab, and reads the command line back.
command -v zsh > /dev/null || { echo "completion in zsh is not tested: install zsh"; exit 77; }
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
ln -s "$1" "$folder/tagwrench"
ln -s "$2" "$folder/_tagwrench"
touch "$folder/push.twr"
cd "$folder" && zsh -f -s "$folder" << 'ZSH'
zmodload zsh/zpty
failed=0
zpty typist "PATH=$1:$PATH zsh -f -i"
zpty -w typist "PS1=; unsetopt beep; fpath=($1 \$fpath); autoload -Uz compinit; compinit -u -D"
zpty -w typist 'show() { print -r -- "<<$BUFFER>>"; BUFFER= }; zle -N show; bindkey "^X" show; print rea""dy'
zpty -r -m typist said '*ready*'
becomes() { # EXPECTED TYPED
  zpty -w -n typist "$2"$'\t\x18'
  zpty -r -m typist said '*<<*>>*'
  got=${${said##*<<}%%>>*}
  [[ $got == $1 ]] || { print "'$2' becomes '$got', not '$1'"; failed=1 }
}
becomes 'tagwrench calibrate ' 'tagwrench cali'
becomes 'tagwrench run --source ' 'tagwrench run --sou'
becomes 'tagwrench run --output jsonl:' 'tagwrench run --output js'
becomes 'tagwrench run --output wrench ' 'tagwrench run --output wr'
becomes 'tagwrench run --source recording:push.twr ' 'tagwrench run --source recording:pu'
becomes 'tagwrench run --profile game ' 'tagwrench run --profile ga'
becomes 'tagwrench run --sensor push.twr ' 'tagwrench run --sensor pu'
zpty -d typist
(( failed )) || print 'completion in zsh: ok'
exit $failed
ZSH
