# SPDX-License-Identifier: Apache-2.0
# shellcheck shell=bash
# Completion of `zerodrift` in bash: commands and options as the program's own --help lists them, file names otherwise.
_zerodrift_commands() {  # HELP
  sed -n '/^\(Subcommands\|Programs of their own\):$/,/^$/s/^  \([a-z][a-z-]*\).*/\1/p' <<< "$1"
}

_zerodrift() {
  local program=$1 current=${COMP_WORDS[COMP_CWORD]} path=() word help
  help=$("$program" --help 2>/dev/null) || return
  for word in "${COMP_WORDS[@]:1:COMP_CWORD-1}"; do
    if grep -qxF -- "$word" <<< "$(_zerodrift_commands "$help")"; then
      path+=("$word")
      help=$("$program" "${path[@]}" --help 2>/dev/null) || return
    fi
  done
  if [[ $current == -* ]]; then
    mapfile -t COMPREPLY < <(compgen -W "$(grep -oE -- '--[a-z][a-z0-9-]*' <<< "$help" | sort -u)" -- "$current")
  else
    mapfile -t COMPREPLY < <(compgen -W "$(_zerodrift_commands "$help")" -- "$current")
  fi
}
complete -o default -F _zerodrift zerodrift
