"""Names that shells complete after options and words whose type is any text, and the files that may stand there."""

import re
import shlex
from dataclasses import dataclass


@dataclass(frozen=True)
class Values:
    """What may stand in a place."""

    names: tuple[str, ...]
    """Names that come with the package."""
    ending: str | None = None
    """Ending of files that may stand there instead, without the dot."""


def option_values() -> dict[str, Values]:
    """Return the values of options, by the option's name without dashes."""
    from typing import get_args

    from tvist_lab.study.menus import UNSHAPED, names
    from tvist_plant.description import robots
    from tvist_server.profiles import ProfileName
    from tvist_shaping import BUILT_IN, SHAPERS

    robot, shaper = Values(robots(), "toml"), Values(BUILT_IN.names(), "py")
    return {
        "robot": robot,
        "robots": robot,
        "shaper": shaper,
        "shapers": shaper,
        "sensitivity": Values(tuple(SHAPERS), "py"),
        "against": Values((UNSHAPED, *names("bench"))),
        "profile": Values(get_args(ProfileName)),
    }


def pose_names() -> Values:
    """Return the poses that the robots of the package name, for the word after `tvist move`."""
    from tvist_plant.description import load, robots

    return Values(tuple(sorted({name for robot in robots() for name in load(robot).poses})))


def bash(script: str) -> str:
    """Return the script for bash, which completes the values before it asks what the parser knows."""
    cases = "".join(
        f"    --{option}) names={shlex.quote(' '.join(values.names))}; ending={values.ending or ''} ;;\n"
        for option, values in option_values().items()
    )
    poses = shlex.quote(" ".join(pose_names().names))
    # COMP_WORDBREAKS contains "=" and ":", so what is completed is the last of such words.
    return f"""{script.replace("complete -F _tvist tvist", "complete -F _tvist_values tvist")}
_tvist_values() {{
  local cur="${{COMP_WORDS[COMP_CWORD]}}" prev="${{COMP_WORDS[COMP_CWORD-1]}}" names= ending=
  [[ $prev == "=" ]] && prev="${{COMP_WORDS[COMP_CWORD-2]}}"
  [[ $cur == "=" ]] && {{ prev="${{COMP_WORDS[COMP_CWORD-1]}}"; cur=; }}
  case "$prev" in
{cases}    move) [[ $COMP_CWORD == 2 && $cur != -* ]] && names={poses} ;;
  esac
  if [[ -z $names ]]; then _tvist "$@"; return; fi
  COMPREPLY=( $(compgen -W "$names" -- "$cur") )
  if [[ -n $ending ]]; then
    compopt -o filenames 2>/dev/null
    COMPREPLY+=( $(compgen -f -X "!*.$ending" -- "$cur") $(compgen -d -- "$cur") )
  fi
}}
"""


def zsh(script: str) -> str:
    """Return the script for zsh, with the values in place of nothing, and a last line that runs it."""
    for option, values in option_values().items():
        action = _zsh_action(option, values)
        # `'*--robot[help]:robot'`: brackets in the help are escaped, so the last one before the colon ends it.
        script = re.sub(rf"('\*?--{option}\[.*\]:{option})'", rf"\1:{action}'", script)
    # The word after `tvist move` is the only one that may be a pose.
    poses = " ".join(pose_names().names)
    script = re.sub(r"('1:Name of a pose[^']*)'", rf"\1:({poses})'", script)
    functions = "".join(
        f"_tvist_{option}() {{ _alternative 'names:name:({' '.join(values.names)})' "
        f"'files:file:_files -g \"*.{values.ending}\"'; }}\n"
        for option, values in option_values().items()
        if values.ending
    )
    # zsh reads the file as the body of a function when something is completed for the first time.
    return f'{script}\n{functions}\n_cyclopts_tvist "$@"\n'


def _zsh_action(option: str, values: Values) -> str:
    return f"_tvist_{option}" if values.ending else f"({' '.join(values.names)})"


def fish(script: str) -> str:
    """Return the script for fish with a line for each option and for the poses."""
    lines = [
        f"complete -c tvist -l {option} {'-r' if values.ending else '-x'} -a {shlex.quote(' '.join(values.names))}"
        for option, values in option_values().items()
    ]
    poses = shlex.quote(" ".join(pose_names().names))
    lines.append(f"complete -c tvist -n '__fish_seen_subcommand_from move' -a {poses}")
    return "\n".join([script.rstrip(), *lines, ""])
