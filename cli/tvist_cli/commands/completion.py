"""`tvist completion`: print the script with which a shell completes commands, options and values."""

from typing import Literal


def completion(shell: Literal["bash", "zsh", "fish"]) -> None:
    """Print the script with which a shell completes the commands, options and values of tvist.

    It completes files and the names of the shapers, robots, poses and profiles that come with the package.

    For bash, add this line to ~/.bashrc: eval "$(tvist completion bash)"

    For zsh, write the output to a file named _tvist in a folder of $fpath.

    For fish, write it to ~/.config/fish/completions/tvist.fish.

    Args:
        shell: Write the script for this shell.
    """
    from tvist_cli.main import OF_GROUPS, application  # it imports a command only when called

    script = application().generate_completion(prog_name="tvist", shell=shell)
    # cyclopts' script for bash takes `bench` in `tvist study bench` for the command `bench`.
    of_group = f'[[ -z "${{cmd_path[0]}}" || " {" ".join(OF_GROUPS)} " == *" ${{cmd_path[*]}} "* ]]'
    script = script.replace('if [[ " $all', f'if {of_group} && [[ " $all')
    # On the first completion, zsh executes the file as the body of a function.
    print(script, end='\n_cyclopts_tvist "$@"\n' if shell == "zsh" else "")
