"""`tvist run`: run URScript programs, each on a new robot."""

from pathlib import Path
from typing import Annotated, Any

from cyclopts import Parameter

from tvist_cli.failure import Misuse
from tvist_cli.robot_options import with_robot_options
from tvist_lab.programs.limits import RunLimits

OPTIONS = {
    "robot", "profile", "payload", "overload", "adapt", "shaper", "shape_servo", "plant", "hidden", "start",
    "seed", "record", "truth", "listen", "ur", "ur_allow", "cell", "world",
}  # fmt: skip
"""Options of `tvist serve` that make sense for one robot that ends with its program."""
NO_LIMITS = RunLimits()


@with_robot_options(OPTIONS)
def run(
    *file: Annotated[Path, Parameter(required=True)],
    check: bool = False,
    translate: bool = False,
    skip: list[str] | None = None,
    answer: list[str] | None = None,
    lockstep: bool = False,
    inputs: Annotated[list[str] | None, Parameter(name="--input")] = None,
    timeout: float | None = None,
    limits: Annotated[RunLimits, Parameter(name="*")] = NO_LIMITS,
    junit: Path | None = None,
    baseline: Path | None = None,
    config: str | None = None,
    json: bool = False,
    **given: Any,
) -> None:
    """Run a program on a new robot, print its messages as they come, and end with an exit code.

    Exit code 0: the program ended by itself, within all limits. Exit code 1: it does not compile; an error, a
    protective stop, a safety stop, a client or --timeout ended it; or it exceeded a limit, or differs from
    --baseline. Errors in the program are printed as FILE:LINE:COLUMN: text. Exit code 2: the command line is
    wrong, or the file cannot be read.

    The program runs in real time, on a robot that other programs can reach as if tvist serve ran it. Popups
    do not pause it: they are printed and closed. With --lockstep, several programs run one after the other,
    each on a new robot.

    With --check, nothing runs. An error is anything that keeps a program from starting: wrong syntax or an
    unknown name. A call that can only fail, since its arguments do not fit or tvist does not simulate the
    function, is a warning: the program ends when it reaches it.

    Args:
        file: Run this program, URScript or a .urp file that PolyScope saved; with --lockstep or --check these
            programs, or all programs of a folder and its subfolders. - reads the standard input.
        check: Look for errors without running anything, and print each as FILE:LINE:COLUMN: text. Exit code
            0: there is none. Exit code 1: there is at least one. Exit code 2: a file cannot be read.
        translate: Print the program as URScript instead of running it.
        skip: Leave out the nodes of this URCap in .urp files, repeatable: a name such as Robotiq_Copilot, or one of its
            nodes such as 'Robotiq_Copilot: Force Control'.
        answer: Answer a question of a .urp file with NAME=VALUE, repeatable. NAME is the variable that gets the answer.
        lockstep: Run as fast as this machine computes, without network; the arm moves exactly as in real
            time. A program that waits for a client then waits for ever: see --input and --timeout. It can
            open sockets only to the gripper of a cell.
        inputs: Set an input before the start with NAME=VALUE, repeatable. NAME is digital_input_N,
            input_bit_register_N, input_int_register_N or input_double_register_N.
        timeout: End the run with exit code 1 after this time in s on the robot's clock [no limit].
        limits: What the runs must keep.
        junit: Write the results to this file as JUnit XML, with a test case for each program.
        baseline: Compare with this file, the --json output of an earlier lockstep run of the same programs;
            fail if times, stops, shake, speeds or warnings differ beyond rounding, and list the differences.
        config: Read options of tvist serve for one robot from this TOML file; options on the command line
            take precedence.
        json: Print one JSON object at the end instead of messages; for several programs it contains a list.
        given: Fields of `ServeConfig`.
    """
    from tvist_cli.program_runs import answers_of, check_scripts, print_scripts
    from tvist_cli.running import run_programs
    from tvist_server.polyscope.nodes import Choices

    choices = Choices(frozenset(skip or ()), answers_of(answer or ()))
    runs = any((given, lockstep, inputs, config, timeout is not None, limits != NO_LIMITS, junit, baseline))
    if translate:
        if runs or check or json:
            raise Misuse("--translate runs nothing: leave out all options but --skip and --answer")
        print_scripts(file, choices)
        return
    if check:
        if runs:
            raise Misuse("--check runs nothing, so that only --json goes with it: leave the others out")
        check_scripts(file, choices, json=json)
        return
    run_programs(
        file, given, choices=choices, lockstep=lockstep, inputs=inputs or (), timeout=timeout, limits=limits,
        junit=junit, baseline=baseline, config=config, json=json,
    )  # fmt: skip
