"""Cost of programs in URScript: of a client library's idle loop in each tick, and of compiling a long program."""

import gc
import sys
import threading
import time
from collections.abc import Callable
from typing import Any

import numpy as np

from tvist_controller.api import LoopbackHost, ScriptCompiler
from tvist_lab.benchmark.in_turn import mean_and_interval
from tvist_lab.benchmark.parts import BATCHES
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
LISTENS = 1e-4
"""Time between two looks at the clock while a program is compiled [s]."""
SWITCHES = 1e-4
"""Time for which a thread of the server keeps the interpreter while another one waits for it [s]."""


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


def programs(tell: Callable[[str], None]) -> dict[str, float]:
    """Return the cost of the idle loop relative to an empty tick, and the times of compiling the long program.

    Args:
        tell: Called with a description of each measurement before it starts.
    """
    tell("a program's idle loop")
    ratio, interval = mean_and_interval(_ratios())
    tell(f"compiling a program of {LINES} lines")
    compiling, held_up = _compiling()
    return {
        "idle_loop_ratio": ratio,
        "idle_loop_interval": interval,
        "compile_ms": compiling,
        "compile_holds_up_ms": held_up,
    }


def _ratios() -> np.ndarray[Any, Any]:
    """Cost of a tick with the idle loop relative to one without, of each pair of runs [-]."""
    without, loaded = _ticks(None), _ticks(idle_loop())
    found = []
    for pair in range(PAIRS):
        first, second = (without, loaded) if pair % 2 == 0 else (loaded, without)
        took = {first: first(), second: second()}
        found.append(took[loaded] / took[without] - 1.0)
    return np.array(found)


def _ticks(text: str | None) -> Callable[[], float]:
    """Return what runs a robot for some ticks, at rest and with a program, and returns its processor time [s]."""
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
        return time.thread_time() - began

    run()
    assert (host.controller.programs.state == "PLAYING") == (text is not None)
    return run


def _compiling() -> tuple[float, float]:
    """Time to compile the long program, and the longest time for which it keeps another thread waiting [ms].

    Each is the least of several repetitions, since other load on the machine only ever adds time.
    """
    compiler = ScriptCompiler(free_setup().description)
    command = ProgramRun(token="bench", text=long_program())  # noqa: S106  no secret
    took, held_up = float("inf"), float("inf")
    before = sys.getswitchinterval()
    sys.setswitchinterval(SWITCHES)
    gc.collect()
    gc.freeze()  # as the server does when it starts
    try:
        for _ in range(2 * BATCHES):
            began = time.perf_counter()
            compiler.compile(command)
            took = min(took, time.perf_counter() - began)
            held_up = min(held_up, _longest_wait(lambda: compiler.compile(command)))
    finally:
        sys.setswitchinterval(before)
        gc.unfreeze()
    return 1e3 * took, 1e3 * held_up


def _longest_wait(work: Callable[[], object]) -> float:
    """Longest delay of a thread that often wakes up while another one works [s]."""
    thread = threading.Thread(target=work)
    longest = 0.0
    thread.start()
    while thread.is_alive():
        asleep = time.perf_counter()
        time.sleep(LISTENS)
        longest = max(longest, time.perf_counter() - asleep - LISTENS)
    thread.join()
    return longest
