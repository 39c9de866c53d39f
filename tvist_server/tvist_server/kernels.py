"""Compile the kernels of a served robot ahead, several parts of them at once, each in a process of its own."""

import os
import subprocess
import sys
import threading
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor

from tvist_controller.instruments.snapshot import Instruments
from tvist_controller.kinematics.inverse import is_compiled as planning_is_compiled
from tvist_controller.loopback import LoopbackHost
from tvist_controller.planner import Planner
from tvist_plant.flexible_arm import is_compiled
from tvist_protocol.codec import decode_reply, encode
from tvist_protocol.commands import Command, MoveJ, TakeControl
from tvist_protocol.replies import Accepted, Done, Reply
from tvist_protocol.simulation import SimulationStep
from tvist_server.config import from_mapping
from tvist_shaping.kernel_cache import unkept

MOVE_TICKS = 500


class KernelsError(RuntimeError):
    """A process that compiles has failed, or could not keep what it compiled."""


def are_compiled() -> bool:
    """Return whether machine code of a served robot is on disk; otherwise its start compiles for long."""
    return is_compiled() and planning_is_compiled()


def compile_ahead(processes: int | None = None) -> None:
    """Compile every kernel that a served robot calls, unless its machine code is on disk already.

    Args:
        processes: Number of processes that compile at once; None for one on each processor of this process.

    Raises:
        KernelsError: Some could not be compiled or kept.
    """
    with ThreadPoolExecutor(processes or processors()) as pool:
        said = [why for why in pool.map(_in_a_process, PARTS) if why]
    if said:
        raise KernelsError(said[0])


def processors() -> int:
    """Return the number of processors that this process may use."""
    return len(os.sched_getaffinity(0)) if sys.platform == "linux" else os.cpu_count() or 1


def _in_a_process(part: str) -> str:
    """Compile a part in a process, which ends with this one; return what has failed."""
    command = [sys.executable, "-m", "tvist_server.kernels", part]
    pipe = subprocess.PIPE
    with subprocess.Popen(command, stdin=pipe, stdout=pipe, stderr=subprocess.STDOUT) as process:  # noqa: S603
        assert process.stdin is not None
        assert process.stdout is not None
        said = process.stdout.read().decode(errors="replace").strip()
        process.stdin.close()
    if process.returncode == 0:
        return ""
    return said.splitlines()[-1] if said else f"a process that compiles ended with {process.returncode}"


def _line() -> None:
    """The control line and the simulated arm: what a tick needs."""
    host = LoopbackHost(from_mapping({"clock": "lockstep", "truth": True}, "configuration").setup())

    def ask(command: Command) -> Reply:
        return decode_reply(host.request("kernels", encode(command)))

    control = ask(TakeControl(client="kernels"))
    assert isinstance(control, Accepted)
    assert control.token is not None
    token = control.token
    assert isinstance(ask(MoveJ(token=token, q=(0.1, -3.0, 0.0, -1.5, 0.0, 0.0))), Accepted)
    assert isinstance(ask(SimulationStep(token=token, ticks=MOVE_TICKS)), Done)
    Instruments(host.controller.setup.description)


def _postures() -> None:
    """Inverse kinematics, in closed form and by iteration."""
    for robot in ("ur5e", "one-joint"):
        _planner(robot).rehearse_postures()


def _plans() -> None:
    """What else plans use."""
    _planner("ur5e").rehearse_plans()


def _planner(robot: str) -> Planner:
    return Planner(from_mapping({"robot": robot}, "configuration").setup())


PARTS: dict[str, Callable[[], None]] = {"postures": _postures, "line": _line, "plans": _plans}
"""What compiles each part; a part takes about as long as any other and shares few kernels with them."""


def _end_with_parent() -> None:
    os.read(sys.stdin.fileno(), 1)  # ends when the parent does; sys.stdin would lock the interpreter's end
    os._exit(1)


def _main() -> None:
    threading.Thread(target=_end_with_parent, daemon=True).start()
    PARTS[sys.argv[1]]()
    if unkept:
        folder, why = next(reversed(unkept.items()))
        sys.exit(
            f"machine code cannot be kept in {folder}: {why}; set NUMBA_CACHE_DIR to a folder that can be written"
        )


if __name__ == "__main__":
    _main()
