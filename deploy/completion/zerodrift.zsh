#compdef zerodrift
# SPDX-License-Identifier: Apache-2.0
# Completion of `zerodrift` in zsh: commands and options as the program's own --help lists them, file names otherwise.
_zerodrift_commands() {  # HELP
  sed -n '/^\(Subcommands\|Programs of their own\):$/,/^$/s/^  \([a-z][a-z-]*\).*/\1/p' <<< "$1"
}

_zerodrift() {
  local program=$words[1] current=$words[CURRENT] word help
  local -a commands_typed
  help=$("$program" --help 2>/dev/null) || return
  for word in "${(@)words[2,CURRENT-1]}"; do
    if grep -qxF -- "$word" <<< "$(_zerodrift_commands "$help")"; then
      commands_typed+=("$word")
      help=$("$program" $commands_typed --help 2>/dev/null) || return
    fi
  done
  if [[ $current == -* ]]; then
    compadd -- ${(f)"$(grep -oE -- '--[a-z][a-z0-9-]*' <<< "$help" | sort -u)"}
  else
    compadd -- ${(f)"$(_zerodrift_commands "$help")"} || _files
  fi
}
_zerodrift "$@"
