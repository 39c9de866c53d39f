"""`tvist completion`: let a shell complete commands and options."""

from typing import Literal


def completion(shell: Literal["bash", "zsh", "fish"]) -> None:
    """Print the script by which a shell completes the commands and options of tvist.

    For bash, add this line to ~/.bashrc: eval "$(tvist completion bash)"

    For zsh, write the output to a file named _tvist in a folder of $fpath.

    For fish, write it to ~/.config/fish/completions/tvist.fish.

    Args:
        shell: Shell that will read the script.
    """
    from tvist_cli.main import application

    print(application().generate_completion(prog_name="tvist", shell=shell), end="")
