"""Compiles the kernels of a served robot in advance, several parts at once in separate processes."""

import gc
import os
import subprocess
import sys
import threading
from collections.abc import Callable
from contextlib import suppress
from functools import cache

import numpy as np

from tvist_controller.dispatch.planner import Planner
from tvist_controller.instruments.snapshot import Instruments
from tvist_controller.kinematics.arm import Arm
from tvist_controller.kinematics.inverse import InverseKinematics
from tvist_controller.loopback import LoopbackHost
from tvist_controller.paths.legs import JointCurve, LegSpeed
from tvist_controller.paths.pacing import JointLimits, ground_of, joined, law_of
from tvist_controller.paths.route import Piece
from tvist_controller.paths.tool_curves import PER_RADIAN, ToolLine
from tvist_controller.paths.tracking import Tracker
from tvist_controller.planning.path_planner import LEAST_WINDOW
from tvist_controller.setup import Setup, body
from tvist_controller.trajectory.spline import SplineCurve
from tvist_kernels.cache import held, kernels, load_all, unkept
from tvist_plant.drives import DriveCommand
from tvist_plant.flexible_arm import FlexibleArm
from tvist_protocol.codec import decode_reply, encode
from tvist_protocol.commands import Command, MoveJ, ServoStart, ServoStop, SetShaper, Stop, TakeControl
from tvist_protocol.errors import TvistError
from tvist_protocol.kinematics import ForwardKinematics
from tvist_protocol.motions import MoveL
from tvist_protocol.replies import Accepted, Refused, Reply, ToolPose
from tvist_protocol.simulation import SimulationStep, StepSetpoint
from tvist_server.config import from_mapping
from tvist_server.gateways.base import Tell
from tvist_server.punctual import processors

MOVE_TICKS = 1000  # longest time of a motion that uses kernels [ticks]
CHECK_EVERY = 0.5  # time between two checks of what is on disk [s]
FILTERS = (("elastic", 1), ("auto", 1), ("zv", 1), ("none", 2))
"""Shapers with numbers of modes; together they use all kernels of shapers."""
STUDIES = {"all_to_drives", "drive", "mean_delay", "play", "product_taps", "shape_all"}
"""Kernels that no served robot calls."""
KERNELS = tuple(kernel for kernel in kernels if kernel.name.rpartition(".")[2] not in STUDIES)
"""Kernels that a served robot may call."""


class KernelsError(TvistError):
    """A compiling process failed, or could not store its result."""


def compiled() -> int:
    """Return how many of `KERNELS` are compiled on disk; starting robots compile the rest, which is slow."""
    return len(held(KERNELS))


@cache
def warm_up() -> None:
    """Load every kernel of a served robot before the first tick; compile those damaged or not on disk."""
    whole = load_all(KERNELS)
    if not whole or compiled() < len(KERNELS):
        for part in PARTS.values():
            part()


def compile_ahead(processes: int | None = None, tell: Tell | None = None) -> None:
    """Compile all served robots' kernels not on disk, in `processes` processes (None: one per processor).

    `tell` gets the progress. Raise KernelsError if a kernel could not be compiled or stored.
    """
    waiting, running, said = list(PARTS), list[subprocess.Popen[bytes]](), ""
    try:
        while waiting or running:
            while waiting and len(running) < (processes or processors()):
                running.append(_begin(waiting.pop(0)))
            if tell is not None:
                tell(compiled(), len(KERNELS))
            with suppress(subprocess.TimeoutExpired):
                running[0].wait(CHECK_EVERY)
            for process in [process for process in running if process.poll() is not None]:
                running.remove(process)
                said = _error_of(process) or said
    finally:  # even if a signal interrupts
        for process in running:
            process.kill()
            process.communicate()
    if said:
        raise KernelsError(said)


def _begin(part: str) -> subprocess.Popen[bytes]:
    """Start a process that compiles a part and ends with this one."""
    command = [sys.executable, "-m", "tvist_server.kernels", part]
    pipe = subprocess.PIPE
    return subprocess.Popen(command, stdin=pipe, stdout=pipe, stderr=subprocess.STDOUT)  # noqa: S603


def _error_of(process: subprocess.Popen[bytes]) -> str:
    """Return the error of a process that has ended; empty if it succeeded."""
    said = process.communicate()[0].decode(errors="replace").strip()
    if process.returncode == 0:
        return ""
    return said.splitlines()[-1] if said else f"a process that compiles ended with {process.returncode}"


def _line() -> None:
    """Compile all that a tick computes: the controller's tick and the simulated arm."""
    setup = from_mapping({"clock": "lockstep", "truth": True, "adapt": "payload"}, "configuration").setup()
    arm, still = FlexibleArm(setup.description, body(setup.payload)), np.zeros(setup.description.joints)
    arm.reset(DriveCommand(still, still, still))
    arm.step(DriveCommand(still, still, still))
    host = LoopbackHost(setup)

    def ask(command: Command) -> Reply:
        return decode_reply(host.request("kernels", encode(command)))

    control = ask(TakeControl(client="kernels"))
    assert isinstance(control, Accepted)
    assert control.token is not None
    token = control.token
    host.subscribe("state", bytes)  # makes the host encode states
    bent = (0.2, -1.4, 1.7, -1.8, -1.5, 0.3)
    found = ask(ForwardKinematics(q=bent))
    assert isinstance(found, ToolPose)
    x, y, z, a, b, c = found.pose
    back = MoveJ(token=token, q=(0.4, *bent[1:]))
    step = SimulationStep(token=token, ticks=MOVE_TICKS)
    commands: list[Command] = [
        MoveJ(token=token, q=bent), step, MoveL(token=token, pose=(x, y, z + 0.05, a, b, c)),
        SimulationStep(token=token, ticks=50), Stop(), step, SetShaper(token=token, name="elastic"), back, step,
        SetShaper(token=token, name="auto"), MoveJ(token=token, q=bent), step,
        SetShaper(token=token, name="none", modes=2), back, SimulationStep(token=token, ticks=100),
        SetShaper(token=token, name="zv"), step,
    ]  # fmt: skip
    here = StepSetpoint(sequence=0, q=back.q)
    for period in (0.002, 0.008):
        stream = SimulationStep(token=token, ticks=10, setpoints=(here,))
        commands += [ServoStart(token=token, period=period), stream, ServoStop(token=token), step]
    for command in commands:
        reply = ask(command)
        assert not isinstance(reply, Refused), reply
    Instruments(host.controller.setup.description)
    _ = host.controller.cycle.shaped.joints.published


def _plans() -> None:
    """Compile filters, inverse kinematics (closed form and iterative) and plans along a path."""
    setup = _setup("ur5e")
    filters = Planner(setup).filters
    filters.first()
    for name, modes in FILTERS:
        filters.choose(name, modes, setup.source(), setup.payload)
    for description in (setup.description, _setup("one-joint").description):
        q = np.zeros(description.joints)
        InverseKinematics(description).solve(*Arm(description).pose(q), q)
    q, tracker = np.zeros(setup.description.joints), Tracker(setup.description, (0.0,) * 6)
    tracker.rates(q, ToolLine(*[tracker.pose(q)] * 2).at(0.0))
    run = [Piece(JointCurve(q, q + 0.1).part(0.0, 0.1 * PER_RADIAN), LegSpeed(1.0, 1.0), None, True, "")]
    limits = setup.description.limits
    joints = JointLimits(np.array(limits.velocity), np.array(limits.acceleration), min(limits.jerk))
    curve = SplineCurve(joined(run))
    for goes_on in (False, True):
        law_of(run, curve, ground_of(run, curve), joints, 60.0, LEAST_WINDOW, goes_on=goes_on)


def _setup(robot: str) -> Setup:
    return from_mapping({"robot": robot}, "configuration").setup()


PARTS: dict[str, Callable[[], None]] = {"line": _line, "plans": _plans}
"""Functions that compile one part each in equal time; `plans` compiles filters before `line` needs them."""


def _end_with_parent() -> None:
    os.read(sys.stdin.fileno(), 1)  # until the parent ends; sys.stdin would block the interpreter's exit
    os._exit(1)


def _main() -> None:
    threading.Thread(target=_end_with_parent, daemon=True).start()
    gc.set_threshold(100_000)  # numba makes many permanent objects
    PARTS[sys.argv[1]]()
    if unkept:
        folder, why = next(reversed(unkept.items()))
        sys.exit(
            f"machine code cannot be kept in {folder}: {why}; set NUMBA_CACHE_DIR to a folder that can be written"
        )


if __name__ == "__main__":
    _main()
