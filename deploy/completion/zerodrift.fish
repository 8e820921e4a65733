# SPDX-License-Identifier: Apache-2.0
# Completion of `zerodrift` in fish: commands and options as the program's own --help lists them, file names otherwise.
function __zerodrift_commands  # of the help on standard input
    sed -n '/^\(Subcommands\|Programs of their own\):$/,/^$/s/^  \([a-z][a-z-]*\).*/\1/p'
end

function __zerodrift
    set -l typed (commandline -opc)
    set -l program $typed[1]
    set -e typed[1]
    set -l commands_typed
    set -l help ($program --help 2>/dev/null); or return
    for word in $typed
        if printf '%s\n' $help | __zerodrift_commands | grep -qxF -- $word
            set -a commands_typed $word
            set help ($program $commands_typed --help 2>/dev/null); or return
        end
    end
    if string match -q -- '-*' (commandline -ct)
        printf '%s\n' $help | grep -oE -- '--[a-z][a-z0-9-]*' | sort -u
    else
        printf '%s\n' $help | __zerodrift_commands
    end
end
complete -c zerodrift -a '(__zerodrift)'
