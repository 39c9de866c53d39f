"""`tvist completion`: let a shell complete commands and options."""

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
    from tvist_cli import completed_values
    from tvist_cli.main import application

    script = application().generate_completion(prog_name="tvist", shell=shell)
    print(
        {"bash": completed_values.bash, "zsh": completed_values.zsh, "fish": completed_values.fish}[shell](
            script
        ),
        end="",
    )
