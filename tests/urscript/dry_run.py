"""Runs a script without a robot."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from tvist_urscript.compiler import compile_script
from tvist_urscript.errors import ScriptError
from tvist_urscript.machine import Machine
from tvist_urscript.values import Value

from .dry_functions import Memory

BUDGET = 20_000
"""Evaluations of a tick: many more than beside a robot, as nothing else has to run in it."""
LONGEST_RUN = 2_000
"""Ticks after which a run is given up."""


@dataclass
class DryRun:
    """What a script has done.

    Attributes:
        memory: What it has said, called and written.
        ticks: Ticks until it ended, or was given up.
        ended: The program has come to its end.
        error: What was wrong with it, None if nothing.
    """

    memory: Memory = field(default_factory=Memory)
    ticks: int = 0
    ended: bool = False
    error: ScriptError | None = None


def dry_run(text: str, inputs: Mapping[str, Sequence[Value]] | None = None) -> DryRun:
    """Run a script without a robot.

    Args:
        text: The script.
        inputs: Contents of the input registers from 0 on, by kind: `int`, `double`, `bit`.
    """
    run = DryRun()
    for kind, values in (inputs or {}).items():
        run.memory.inputs[kind].update(enumerate(values))
    table = run.memory.functions()
    try:
        script = compile_script(text, {name: entry[0] for name, entry in table.items()})
        machine = Machine(script, {name: entry[1] for name, entry in table.items()})
        while machine.running and run.ticks < LONGEST_RUN:
            run.ticks += 1
            machine.resume(BUDGET)
    except ScriptError as error:
        run.error = error
        return run
    run.ended = not machine.running
    machine.end()
    return run
