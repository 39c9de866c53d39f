"""Cost of URScript programs: a client library's idle loop in each tick, and compiling a long program."""

import gc
import time
from collections.abc import Callable

from benchmarks.figure import Figure, Tell, figure, in_alternation
from tvist_controller.api.robot import LoopbackHost, ScriptCompiler
from tvist_lab.bench.moving import Run
from tvist_lab.in_process import free_setup
from tvist_protocol.codec import encode
from tvist_protocol.commands import TakeControl
from tvist_protocol.programs import ProgramRun
from tvist_protocol.simulation import SimulationStep

CASES, LINES = 60, 1200  # number of commands that the idle loop distinguishes, and lines of the long program
TICKS, PAIRS, COMPILED = 250, 40, 10
"""Ticks of a run, pairs of runs, and repetitions of compiling the long program."""


PART = """  def part_{0}(count):
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


def idle_loop() -> str:
    """Return a program like those of client libraries, which look for a command in a register once per tick."""
    cases = "".join(f"elif command == {case}:\n    done = {case}\n" for case in range(1, CASES + 1))
    return f"""def idle_loop():
  done = 0
  count = 0
  while True:
    command = read_input_integer_register(0)
    {cases.removeprefix("el")}    end
    count = count + 1
    write_output_integer_register(0, count)
    sync()
  end
end
"""


def long_program() -> str:
    """Return a program of `LINES` lines with functions, branches, moves and registers."""
    parts = range((LINES - 3) // (PART.count("\n") + 1))
    functions = "".join(PART.format(number, number % 24) for number in parts)
    calls = "".join(f"  n = part_{number}(n)\n" for number in parts)
    text = f"def long_program():\n{functions}  n = 0\n{calls}"
    return text + "  sync()\n" * (LINES - 1 - text.count("\n")) + "end\n"


def programs(tell: Tell) -> dict[str, Figure]:
    """Measure the idle loop against an empty tick, and compiling the long program against Python's compiler."""
    tell("a program's idle loop")
    ticks = in_alternation({"empty": _ticks(None), "loop": _ticks(idle_loop())}, PAIRS)
    idle = figure(
        "a tick of a client library's idle loop", "µs", ticks["loop"], "an empty tick", ticks["empty"]
    )
    tell(f"compiling a program of {LINES} lines")
    took = in_alternation({"ours": _our_compiler(), "python": _python_compiler()}, COMPILED)
    compiled = figure(f"compiling {LINES} lines", "ms", took["ours"], "Python's compiler", took["python"])
    return {"idle_loop_us_per_tick": idle, "compile_ms": compiled}


def _ticks(text: str | None) -> Run:
    """Return a function that runs a robot at rest, perhaps with a program, and returns the time of a tick [µs]."""
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


def _our_compiler() -> Run:
    description = free_setup().description
    command = ProgramRun(token="bench", text=long_program())  # noqa: S106  no secret
    # A new compiler each time, since it caches its results.
    return lambda: _took(lambda: ScriptCompiler(description).compile(command))


def _python_compiler() -> Run:
    """Use Python's compiler on the same program, which is Python except for poses and the ends of blocks."""
    lines = [line for line in long_program().splitlines() if line.strip() != "end"]
    text = "\n".join(lines).replace(" p[", " [")
    return lambda: _took(lambda: compile(text, "long_program", "exec"))


def _took(work: Callable[[], object]) -> float:
    """Return the time that a call takes [ms]."""
    gc.collect()
    began = time.perf_counter()
    work()
    return 1e3 * (time.perf_counter() - began)
