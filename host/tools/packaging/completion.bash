# Completion of tagwrench in bash: the program itself knows what may come.
# shellcheck shell=bash
_tagwrench() {
  local cur words cword lines
  _get_comp_words_by_ref -n : cur words cword
  mapfile -t lines < <("${words[0]}" complete -- "${words[@]:1:cword}" 2>/dev/null)
  [ ${#lines[@]} -gt 0 ] || return
  COMPREPLY=("${lines[@]:1}")
  [[ ${COMPREPLY-} != *: ]] || compopt -o nospace
  if [[ ${lines[0]} == files* ]]; then
    local before=${lines[0]#files } file
    [ -n "$before" ] || compopt -o filenames
    while IFS= read -r file; do COMPREPLY+=("$before$file"); done < <(compgen -f -- "${cur#"$before"}")
  fi
  __ltrim_colon_completions "$cur"
} && complete -F _tagwrench tagwrench
