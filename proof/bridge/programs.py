"""Programs that were written for a robot, pointed at the bridge instead."""

import asyncio
import os
import sys
import tempfile
from asyncio.subprocess import DEVNULL, PIPE, STDOUT
from collections.abc import Callable, Sequence
from contextlib import AsyncExitStack, suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from proof.bridge.ring import CLOSE, WINDOW_S, Stop, apart, compared, noise_of, stops
from tvist_client.errors import ClientError
from tvist_client.readiness import look
from tvist_client.robot import Robot
from tvist_client.unlock import make_ready
from tvist_lab.identification.modal import identify_modal
from tvist_lab.identification.modal_plan import ModalPlan, jog_of
from tvist_lab.in_process import free_setup, robot_in_process
from tvist_lab.recordings.mcap_file import read
from tvist_lab.served import served
from tvist_plant.description import load
from tvist_protocol.calibration import calibration_to_json
from tvist_protocol.errors import RefusedError
from tvist_protocol.stream import Event

OURS = {
    **{
        name: ("proof.bridge.ur_rtde_program", name, "{address}", "{seed}")
        for name in ("moveJ", "moveL", "servoJ-500", "servoJ-125")
    },
    "policy-20": ("proof.bridge.policy", "{endpoint}", "{name}", "{seed}"),
}
"""Programs of this package: the module, and what it is given."""
URCL = "URCL-trajectory"
PATIENCE_S = 120.0
"""Longest time of a program [s]."""
CAP = "3.2"
"""Speed cap of the bridge [rad/s]: a lower one would slow the programs down, and make less ring by that alone."""
TRIES = 3
"""How often a program is begun, and how often the bridge tries to hold the robot before."""
TOLD = {"protective_stop", "safety_stop", "stream_stopped", "warning"}
"""Events of whom a program talks to that are reported if it does not run through."""
REST_S = 1.0
"""Rest before the first program, which shows the sensor's noise [s]."""
HEARD = 2.0
"""A motion counts that rings this much louder than the sensor's noise [-]."""


@dataclass(frozen=True)
class Ways:
    """What is measured."""

    robot: str
    hidden: int
    seed: int
    programs: Sequence[str]
    urcl: tuple[Path, Path] | None
    """Folders of the sources and of the build of UR's C++ library."""


@dataclass
class Ran:
    """A program that was run."""

    code: int | None
    """Its exit code; None if it had to be killed."""
    said: str
    ticks: tuple[int, int]
    """The robot's ticks meanwhile."""
    tries: int = 1
    """How often it was begun: on a machine under load a bridge loses its robot, which then brakes by itself."""
    stops: list[Stop] = field(default_factory=list)


def report(
    ways: Ways, shapers: Sequence[str], calibration: Path | None, tell: Callable[[str], None], *, inside: bool
) -> dict[str, Any]:
    """Run programs on a hidden robot, and the same again by the bridge with each shaper.

    Args:
        ways: What is measured.
        shapers: Shapers of the bridge.
        calibration: Calibration of the robot; None to identify it first, from twelve ring-downs.
        tell: Called with what is done.
        inside: Whether the shaper is inside the robot, instead of the bridge before it.
    """
    with tempfile.TemporaryDirectory() as folder:
        if calibration is None:
            tell("identifying the robot")
            calibration = Path(folder) / "identified.json"
            calibration.write_bytes(asyncio.run(_identified(ways)))
        runs: dict[str, dict[str, Ran]] = {}
        for number, shaper in enumerate(("", *shapers)):
            tell(f"the programs by way of {shaper}" if shaper else "the programs on the robot itself")
            file = Path(folder) / f"{number}.mcap"
            runs[shaper] = asyncio.run(_run(ways, file, shaper, calibration, tell, inside=inside))
            recording = read(file).recording
            for ran in runs[shaper].values():
                ran.stops = stops(recording, ran.ticks)
            if not shaper:
                noise = noise_of(recording, next(iter(runs[""].values())).ticks[0])
    rows = [
        _row(name, shaper, runs[""][name], runs[shaper][name], noise)
        for shaper in shapers
        for name in runs[shaper]
    ]
    return {"robot": ways.robot, "hidden": ways.hidden, "seed": ways.seed, "inside": inside, "programs": rows}


def tables(result: dict[str, Any]) -> list[tuple[Sequence[str], Sequence[Sequence[str]]]]:
    """Return a row for each program and shaper."""
    rows = result["programs"]
    columns = [name for name in rows[0] if name not in ("rings", "said")]
    return [(columns, [[_shown(row[name]) for name in columns] for row in rows])]


def _shown(value: object) -> str:
    return f"{value:.3g}" if isinstance(value, float) else str(value)


def _row(name: str, shaper: str, direct: Ran, other: Ran, noise: float) -> dict[str, Any]:
    """What has come of a program, on the robot and by another way."""
    wrong = _wrong(direct, other)
    pairs = [] if wrong else compared(direct.stops, other.stops, noise)
    rings = [pair for pair in pairs if pair[0] > HEARD * noise]
    without, by = (sum(ring[way] for ring in rings) / max(len(rings), 1) for way in (0, 1))
    return {
        "program": name,
        "shaper": shaper,
        "ran through": wrong or "yes",
        "tries": other.tries,
        "motions": f"{len(pairs)} of {len(direct.stops)}",
        "that ring": len(rings),
        "ring m/s²": without,
        "by the bridge": by,
        "less %": 100.0 * (1.0 - by / without) if rings else float("nan"),
        "least %": min((100.0 * (1.0 - b / a) for a, b in rings), default=float("nan")),
        "rings": pairs,
        "said": "" if not wrong else (direct if direct.code else other).said,
    }


def _wrong(direct: Ran, other: Ran) -> str:
    """Why two runs of a program cannot be compared; empty if they can."""
    for what, ran in (("the robot", direct), ("the bridge", other)):
        if ran.code != 0:
            return (
                f"on {what}: exit code {ran.code}"
                if ran.code is not None
                else f"on {what}: killed after {PATIENCE_S:g} s"
            )
    if not direct.stops:
        return "on the robot: nothing moved"
    if not other.stops:
        return "by the bridge: nothing moved"
    if (off := apart(direct.stops[-1], other.stops[-1])) > CLOSE:
        return f"by the bridge: it ended {off:.3f} rad from where it does on the robot"
    return ""


async def _identified(ways: Ways) -> bytes:
    """Return what twelve ring-downs tell of the hidden robot, with what it carries."""
    description = load(ways.robot)
    setup = free_setup(robot=ways.robot, hidden=ways.hidden, seed=ways.seed, calibration="none", truth=False)
    plan = ModalPlan(seed=ways.seed, jog=jog_of(description))
    async with robot_in_process(setup) as robot, robot.control("identify") as arm:
        done = await identify_modal(
            robot, arm, description, plan, name="identified", command="python -m proof bridge programs",
            progress=lambda: None,
        )  # fmt: skip
    return calibration_to_json(done.calibration)


async def _run(
    ways: Ways, file: Path, shaper: str, calibration: Path, tell: Callable[[str], None], *, inside: bool
) -> dict[str, Ran]:
    """Run all programs, on the robot itself if there is no shaper."""
    shaping = ["--shaper", shaper, "--shape-servo", "--calibration", str(calibration)] if shaper else []
    robot_is = f"--robot {ways.robot} --profile real --realtime-priority --ur"
    hidden = (
        f"{robot_is} --ur-address {_address(1)} --hidden {ways.hidden} --seed {ways.seed} --record {file}"
    )
    own = shaping if inside and shaper else ["--shaper", "none"]
    async with AsyncExitStack() as stack:
        robot = await stack.enter_async_context(served([*hidden.split(), *own], ways.robot))
        to, name, address = robot, ways.robot, _address(1)
        if shaper and not inside:
            name, address = "bridge", _address(2)
            bridge = (
                f"{robot_is} --ur-address {address} --plant ur://{_address(1)} --enable-motion --speed-cap {CAP} "
                "--servo-lag simulated"
            )
            to = await stack.enter_async_context(served([*bridge.split(), *shaping], name))
        words = {"address": address, "endpoint": to.endpoint, "name": name, "seed": str(ways.seed)}
        await asyncio.sleep(REST_S)
        ran = {}
        for program in ways.programs:
            tell(f"  {program}")
            for tries in range(1, TRIES + 1):
                if to is not robot:
                    await _held(to.robot, tell)
                ran[program] = await _ran(program, words, ways, robot.robot, to.robot)
                ran[program].tries = tries
                if ran[program].code == 0:
                    break
        return ran


async def _held(bridge: Robot, tell: Callable[[str], None]) -> None:
    """See that the bridge holds the robot."""
    for _ in range(TRIES):
        if (found := await look(bridge)).ready:
            return
        tell(f"  {found.sentence}")
        async with bridge.control("proof") as arm:
            with suppress(RefusedError, ClientError):
                await make_ready(bridge, arm, power_on=True)
        await asyncio.sleep(REST_S)


async def _ran(program: str, words: dict[str, str], ways: Ways, robot: Robot, to: Robot) -> Ran:
    """Run a program to its end, and listen to whom it talks to."""
    folder = None
    if program == URCL:
        assert ways.urcl is not None
        folder, build = ways.urcl
        command = [str(build / "examples" / "trajectory_point_interface_example"), words["address"]]
    else:
        module, *given = OURS[program]
        command = [sys.executable, "-m", module, *(one.format(**words) for one in given)]
    events: list[Event] = []
    forget = to.on_event(events.append)
    begun = (await robot.info()).tick
    process = await asyncio.create_subprocess_exec(
        *command, cwd=folder, stdin=DEVNULL, stdout=PIPE, stderr=STDOUT
    )
    try:
        printed, _ = await asyncio.wait_for(process.communicate(), PATIENCE_S)
        said, code = printed.decode(errors="replace")[-2000:], process.returncode
    except TimeoutError:
        process.kill()
        said, code = "", None
    await asyncio.sleep(WINDOW_S)
    forget()
    told = "".join(f"{event.kind}: {event.why}\n" for event in events if event.kind in TOLD)
    return Ran(code, told + said, (begun, (await robot.info()).tick))


def _address(last: int) -> str:
    """Return an address of this machine that no other process takes for its robot: UR's ports cannot be chosen."""
    pid = os.getpid()
    return f"127.{pid // 250 % 250 + 1}.{pid % 250 + 1}.{last}"
