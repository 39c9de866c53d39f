"""`tvist completion`: print the script by which a shell completes commands, options and the values of options."""

import re
import shlex
from dataclasses import dataclass
from typing import Literal


def completion(shell: Literal["bash", "zsh", "fish"]) -> None:
    """Print the script by which a shell completes the commands, options and values of tvist.

    It completes the names of shapers, robots, poses and profiles that come with the package, and files.

    For bash, add this line to ~/.bashrc: eval "$(tvist completion bash)"

    For zsh, write the output to a file named _tvist in a folder of $fpath.

    For fish, write it to ~/.config/fish/completions/tvist.fish.

    Args:
        shell: Shell that will read the script.
    """
    from tvist_cli.main import application

    script = application().generate_completion(prog_name="tvist", shell=shell)
    print({"bash": _bash, "zsh": _zsh, "fish": _fish}[shell](script), end="")


@dataclass(frozen=True)
class _Values:
    """What may stand in a place."""

    names: tuple[str, ...]
    """Names that come with the package."""
    ending: str | None = None
    """Ending of files that may stand there instead, without the dot."""


def _option_values() -> dict[str, _Values]:
    """Return the values of options, by the option's name without dashes."""
    from typing import get_args

    from tvist_controller.sources.own_plants import named_plants
    from tvist_lab.study.menus import rows
    from tvist_plant.description import robots
    from tvist_plant.world.scene_file import scenes
    from tvist_server.profiles import ProfileName
    from tvist_shaping import BUILT_IN, SHAPERS

    robot, shaper = _Values(robots(), "toml"), _Values(BUILT_IN.names(), "py")
    return {
        "robot": robot,
        "robots": robot,
        "shaper": shaper,
        "sensitivity": _Values(tuple(SHAPERS), "py"),
        "shapers": _Values(tuple(row.name for row in rows()), "py"),
        "plant": _Values(tuple(named_plants()), "py"),
        "world": _Values(tuple(scenes()), "xml"),
        "profile": _Values(get_args(ProfileName)),
    }


def _pose_names() -> _Values:
    """Return the poses that the robots of the package name, for the word after `tvist move`."""
    from tvist_plant.description import load, robots

    return _Values(tuple(sorted({name for robot in robots() for name in load(robot).poses})))


def _bash(script: str) -> str:
    """Return the script for bash, which completes the values before it asks what the parser knows."""
    cases = "".join(
        f"    --{option}) names={shlex.quote(' '.join(values.names))}; ending={values.ending or ''} ;;\n"
        for option, values in _option_values().items()
    )
    poses = shlex.quote(" ".join(_pose_names().names))
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


def _zsh(script: str) -> str:
    """Return the script for zsh, with the values in place of nothing, and a last line that runs it."""
    for option, values in _option_values().items():
        action = _zsh_action(option, values)
        # `'*--robot[help]:robot'`: brackets in the help are escaped, so the last one before the colon ends it.
        script = re.sub(rf"('\*?--{option}\[.*\]:{option})'", rf"\1:{action}'", script)
    # The word after `tvist move` is the only one that may be a pose.
    poses = " ".join(_pose_names().names)
    script = re.sub(r"('1:Name of a pose[^']*)'", rf"\1:({poses})'", script)
    functions = "".join(
        f"_tvist_{option}() {{ _alternative 'names:name:({' '.join(values.names)})' "
        f"'files:file:_files -g \"*.{values.ending}\"'; }}\n"
        for option, values in _option_values().items()
        if values.ending
    )
    # zsh reads the file as the body of a function when something is completed for the first time.
    return f'{script}\n{functions}\n_cyclopts_tvist "$@"\n'


def _zsh_action(option: str, values: _Values) -> str:
    return f"_tvist_{option}" if values.ending else f"({' '.join(values.names)})"


def _fish(script: str) -> str:
    """Return the script for fish with a line for each option and for the poses."""
    lines = [
        f"complete -c tvist -l {option} {'-r' if values.ending else '-x'} -a {shlex.quote(' '.join(values.names))}"
        for option, values in _option_values().items()
    ]
    poses = shlex.quote(" ".join(_pose_names().names))
    lines.append(f"complete -c tvist -n '__fish_seen_subcommand_from move' -a {poses}")
    return "\n".join([script.rstrip(), *lines, ""])
