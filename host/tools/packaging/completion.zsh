#compdef tagwrench
# Completion of tagwrench in zsh: the program itself knows what may come.
local -a lines open whole
lines=("${(@f)$("${(Q)words[1]}" complete -- "${(@Q)words[2,CURRENT]}" 2>/dev/null)}")
open=(${(M)lines[2,-1]:#*:})
whole=(${lines[2,-1]:#*:})
(( $#whole )) && compadd -a whole
(( $#open )) && compadd -S '' -a open
if [[ $lines[1] == files* ]]; then
  compset -P "${lines[1]#files }"
  _files
fi
