"""Cost of programs in URScript: of a client library's idle loop in each tick, and of compiling a long program."""

import gc
import time
from collections.abc import Callable

from proof.bench.figure import Figure, figure, in_alternation
from tvist_controller.api.robot import LoopbackHost, ScriptCompiler
from tvist_lab.in_process import free_setup
from tvist_protocol.codec import encode
from tvist_protocol.commands import TakeControl
from tvist_protocol.programs import ProgramRun
from tvist_protocol.simulation import SimulationStep

CASES = 60
"""Number of commands that the idle loop distinguishes."""
LINES = 1200
"""Number of lines of the long program."""
TICKS = 250
"""Number of ticks of a run."""
PAIRS = 40
"""Number of pairs of runs."""
COMPILED = 10
"""Number of times that it is compiled."""


def idle_loop() -> str:
    """Return a program like those of client libraries: it looks for a command in a register once a tick."""
    cases = [
        f"  {'if' if case == 0 else 'elif'} command == {case + 1}:\n    done = {case + 1}"
        for case in range(CASES)
    ]
    lines = "\n".join(cases).splitlines()
    loop = [
        "command = read_input_integer_register(0)", *(line.removeprefix("  ") for line in lines), "end",
        "count = count + 1", "write_output_integer_register(0, count)", "sync()",
    ]  # fmt: skip
    body = ["done = 0", "count = 0", "while True:", *(f"  {line}" for line in loop), "end"]
    return "\n".join(("def idle_loop():", *(f"  {line}" for line in body), "end", ""))


def long_program() -> str:
    """Return a program of `LINES` lines: functions with branches, moves and registers."""
    part = """  def part_{0}(count):
    if count > {0} and read_input_integer_register(1) != 2 * {0}:
      q = [0.1 * count, -1.5, -2.0, cos({0}), 1.5, 0.001 * {0}]
      movej(q, a=1.4, v=1.05, r=0.01)
    elif count == {0}:
      movel(pose_trans(get_target_tcp_pose(), p[0, 0, 0.001 * {0}, 0, 0, 0]), a=1.2, v=0.25)
    else:
      write_output_integer_register({1}, count + {0} * (count - 1))
      textmsg("part {0}: ", count)
    end
    return count + 1
  end
"""
    parts = (LINES - 3) // (part.count("\n") + 1)
    functions = "".join(part.format(number, number % 24) for number in range(parts))
    calls = "".join(f"  n = part_{number}(n)\n" for number in range(parts))
    text = f"def long_program():\n{functions}  n = 0\n{calls}"
    return text + "  sync()\n" * (LINES - 1 - text.count("\n")) + "end\n"


def programs(tell: Callable[[str], None]) -> dict[str, Figure]:
    """Measure the idle loop beside an empty tick, and compiling the long program beside Python's own compiler.

    Args:
        tell: Called with a description of each measurement before it starts.
    """
    tell("a program's idle loop")
    ticks = in_alternation({"empty": _ticks(None), "loop": _ticks(idle_loop())}, PAIRS)
    tell(f"compiling a program of {LINES} lines")
    ours, theirs = _our_compiler(), _python_compiler()
    compiling = in_alternation({"ours": lambda: _took(ours), "python": lambda: _took(theirs)}, COMPILED)
    return {
        "idle_loop_us_per_tick": figure(
            "a tick with a client library's idle loop", "µs", ticks["loop"], "an empty tick", ticks["empty"]
        ),
        "compile_ms": figure(
            f"compiling {LINES} lines", "ms", compiling["ours"], "Python's compiler", compiling["python"]
        ),
    }


def _ticks(text: str | None) -> Callable[[], float]:
    """Return what runs a robot at rest, with a program or without, and returns the processor time of a tick [µs]."""
    host = LoopbackHost(free_setup(truth=False))
    host.subscribe("state", len)
    host.subscribe("io", len)
    host.request("bench", encode(TakeControl(client="bench")))
    lease = host.controller.session.lease
    token = lease.token if lease else ""
    if text is not None:
        host.request("bench", encode(ProgramRun(token=token, text=text)))
    step = encode(SimulationStep(token=token, ticks=TICKS))

    def run() -> float:
        began = time.thread_time()
        host.request("bench", step)
        return 1e6 * (time.thread_time() - began) / TICKS

    run()
    assert (host.controller.programs.state == "PLAYING") == (text is not None)
    return run


def _our_compiler() -> Callable[[], object]:
    description = free_setup().description
    command = ProgramRun(token="bench", text=long_program())  # noqa: S106  no secret
    return lambda: ScriptCompiler(description).compile(command)  # a compiler keeps what it has compiled


def _python_compiler() -> Callable[[], object]:
    """Python's compiler of the same program, which is Python but for the ends of its blocks and the poses."""
    lines = [line for line in long_program().splitlines() if line.strip() != "end"]
    text = "\n".join(lines).replace(" p[", " [")
    return lambda: compile(text, "long_program", "exec")


def _took(work: Callable[[], object]) -> float:
    """Time that something takes [ms]."""
    gc.collect()
    began = time.perf_counter()
    work()
    return 1e3 * (time.perf_counter() - began)
