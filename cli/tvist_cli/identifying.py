"""Identifies a robot by ring-downs of a simulation in this process, a served robot, one at ur://, or logs."""

import asyncio
import sys
from collections.abc import AsyncIterator, Sequence
from contextlib import AsyncExitStack, asynccontextmanager, nullcontext
from pathlib import Path
from typing import TYPE_CHECKING

from tvist_cli.connection import Connection
from tvist_cli.failure import Failure, Misuse, failing_on
from tvist_cli.figure_files import FigureOptions
from tvist_cli.identified import angles, report, report_payload, report_twin
from tvist_cli.output import err, say, table, typed, waiting
from tvist_client.arm import Arm
from tvist_client.errors import MotionStoppedError
from tvist_client.robot import Robot
from tvist_controller.api.line import Setup, paper_payload
from tvist_controller.setup import check_rating
from tvist_lab.identification.calibrate import CalibrationResult, ModeErrors, calibrate, true_errors
from tvist_lab.identification.jogs import JogPlan, RingDownLogs, make_jogs, plan_jogs
from tvist_lab.identification.payload import identify_payload
from tvist_lab.identification.ring_downs import Log, Progress
from tvist_lab.identification.twin import fit_twin
from tvist_lab.identification.twin_file import twin_file
from tvist_lab.in_process import robot_in_process
from tvist_lab.recordings import read
from tvist_lab.served import ServedError, served_robot
from tvist_lab.whole_file import write_whole
from tvist_plant.description import DescriptionError, RobotDescription, load, robots
from tvist_protocol import RefusedError, RobotMode
from tvist_protocol.calibration import calibration_to_json
from tvist_server.config import from_mapping
from tvist_server.watching.address import place_of

if TYPE_CHECKING:
    from matplotlib.figure import Figure

ROBOT = "ur5e"  # robot that is identified unless another one is named
READY = 30.0  # longest wait for the robot to follow set-points [s]
MOVED = 0.01
"""Largest distance of a joint from the start of the planned moves [rad]; beyond it, nothing moves."""


def from_logs(
    files: Sequence[Path],
    checks: Sequence[Path],
    robot: str | None,
    masses: tuple[float, ...] | None,
    columns: str | None,
    output: Path,
    figures: Path | None,
    look: FigureOptions,
    *,
    twin: bool,
    json: bool,
) -> None:
    """Write a calibration fitted to stops in logs, or a twin that repeats their motions."""
    arm, logs = _robot_logs(
        [*files, *checks], robot, None if masses is None else masses[0], columns, len(files)
    )
    measured = RingDownLogs(tuple(logs))
    with waiting("identifying") as step:
        if twin:
            made = fit_twin(arm, logs[: len(files)], logs[len(files) :], step)
            write_whole(output, twin_file(made, typed()).encode())
        else:
            found = _calibrated(arm, measured, output, step)
    if twin:
        report_twin(made, output, json=json)
        return
    look.write(figures, lambda: _figures(found, arm, None))
    named = robot or arm.robot.name
    report(found, measured, output, "" if named == ROBOT else f" --robot {named}", None, json=json)


def _calibrated(
    arm: RobotDescription, measured: RingDownLogs, output: Path, step: Progress
) -> CalibrationResult:
    found = calibrate(arm, measured, name=output.stem, command=typed(), progress=step)
    write_whole(output, calibration_to_json(found.calibration))
    return found


class MovableRobot:
    """A robot that can be moved: a served one, one at ur://, or if there is no source one in this process."""

    def __init__(
        self,
        source: Connection | str | None,
        robot: str | None,
        masses: tuple[float, ...] | None,
        ring_downs: int,
        seed: int,
        *,
        sure: bool,
    ) -> None:
        self._source, self._robot, self._masses = source, robot, masses
        self._ring_downs, self._seed, self._sure = ring_downs, seed, sure
        self._setup: Setup | None = None
        self._positions = isinstance(source, str)
        if isinstance(source, str):
            with failing_on(ValueError, DescriptionError, exit_code=2):
                place_of(source)
                load(robot or ROBOT)
            if masses is not None and len(masses) > 1:
                raise Misuse("payload is several masses: give the one that the robot carries")
            if not (sure or sys.stdin.isatty()):
                raise Misuse(
                    "the arm would move, and there is no terminal to ask for your consent: run this on a terminal, or "
                    "give --yes"
                )
        elif source is None:
            content = {
                "robot": robot or ROBOT,
                "payload": None if masses is None else max(masses),
                "overload": True,  # accepted here; refused below with another message
                "calibration": "none",
                "clock": "free",
                "seed": seed,
            }
            with failing_on(ValueError, exit_code=2):
                self._setup = from_mapping(content, "options").setup()
                check_rating(self._setup.payload, self._setup.description)

    def weigh(self, *, declare: bool, json: bool) -> None:
        """Identify the payload and print it."""

        async def run(step: Progress) -> None:
            async with self._robot_and_file() as (client, arm), client.control("identify") as control:
                found = await identify_payload(client, control, arm, seed=self._seed, progress=step)
                new = found.payload
                if declare:
                    await control.set_payload(new.mass, new.com, new.inertia)
            report_payload(found, declared=declare, json=json)

        with waiting("weighing") as step:
            asyncio.run(run(step))

    def identify(self, output: Path, figures: Path | None, look: FigureOptions, *, json: bool) -> None:
        """Make jogs, write the calibration fitted to them, and print its quality."""
        picture = output.with_suffix(".moves.png")

        async def run(step: Progress) -> tuple[RobotDescription, RingDownLogs]:
            async with self._robot_and_file() as (client, arm):
                step("planning the moves")
                masses = self._masses
                if masses is None and self._setup is not None:
                    masses = tuple(sorted({0.0, arm.payload.mass}))
                changed = () if masses is None or self._positions else masses
                payloads = tuple(paper_payload(arm, mass) for mass in changed)
                plan = await plan_jogs(
                    client,
                    arm,
                    self._ring_downs,
                    payloads=payloads,
                    seed=self._seed,
                    positions=self._positions,
                )
                if self._positions:
                    return arm, await _agreed_jogs(client, plan, picture, step, sure=self._sure)
                async with client.control("identify") as control:
                    return arm, await make_jogs(client, control, plan, step)

        # The question to the user needs the screen.
        shown = nullcontext(say) if self._positions else waiting("identifying")
        with failing_on(ServedError), shown as step:
            arm, measured = asyncio.run(run(step))
            found = _calibrated(arm, measured, output, step)
        payloads, true = found.forecast.arm.payloads, None
        if self._setup is not None:
            true = true_errors(arm, found.calibration, payloads, self._seed, found.modes)
        look.write(figures, lambda: _figures(found, arm, true))
        options = f" --robot {self._robot}" if self._robot not in {None, ROBOT} else ""
        if self._positions:
            options = f" --robot {self._robot or ROBOT} --plant {self._source}"
        more = {"picture": str(picture)} if self._positions else {}
        report(found, measured, output, options, true, json=json, more=more)

    @asynccontextmanager
    async def _robot_and_file(self) -> AsyncIterator[tuple[Robot, RobotDescription]]:
        async with AsyncExitStack() as stack:
            if self._setup is not None:
                yield await stack.enter_async_context(robot_in_process(self._setup)), self._setup.description
            elif isinstance(self._source, Connection):
                client = await stack.enter_async_context(await self._source.robot())
                yield client, _robot_file(self._robot, {(await client.info()).model}, "the robot")
            else:
                robot = self._robot or ROBOT
                options = ["--plant", str(self._source), "--enable-motion", "--robot", robot]
                options += ["--calibration", "none", "--shaper", "none"]
                options += [] if self._masses is None else ["--payload", f"{self._masses[0]:g}"]
                say(f"starting the server that moves the robot at {self._source}")
                arm = load(robot)
                client, _ = await stack.enter_async_context(served_robot(options, arm.robot.name))
                yield client, arm


def _robot_file(robot: str | None, models: set[str], what: str) -> RobotDescription:
    """Load the robot file `robot` (name or path), or if None the package's file for the only model."""
    if robot is None:
        fitting = [name for name in robots() if load(name).robot.model in models]
        if len(models) != 1 or len(fitting) != 1:
            why = f"{what}: {' and '.join(sorted(models))}" if models else f"{what} not named"
            raise Misuse(f"robot is unknown ({why}): give --robot, one of {', '.join(robots())}, or a file")
        robot = fitting[0]
    with failing_on(DescriptionError, exit_code=2):
        return load(robot)


def _robot_logs(
    files: Sequence[Path],
    robot: str | None,
    mass: float | None,
    columns: str | None,
    known: int,
) -> tuple[RobotDescription, list[Log]]:
    """Read logs; return the robot's description and the logs with their payloads."""
    recordings = [read(file, columns) for file in files]
    for file, recording in zip(files, recordings, strict=True):
        for note in recording.notes:
            say(f"{file}: {note}")
    models = {recording.info.model for recording in recordings[:known] if recording.info is not None}
    description = _robot_file(robot, models, "the logs name")
    payload = None if mass is None else paper_payload(description, mass)
    return description, [Log(str(file), one, payload) for file, one in zip(files, recordings, strict=True)]


def _figures(
    found: CalibrationResult, arm: RobotDescription, true: list[ModeErrors] | None
) -> "dict[str, Figure]":
    """Draw the measured modes; if the truth is known, also maps of the lowest mode over the workspace."""
    from tvist_lab.figures import identified_figure, workspace_map_figure
    from tvist_lab.identification.workspace_map import QUANTITIES, workspace_map

    measured, fitted = found.lowest_mode
    mass = found.calibration.payload.mass
    words = f"{arm.robot.name}, {mass:g} kg, calibration {found.calibration.name}"
    drawn = {}
    if measured.size:
        drawn["identification"] = identified_figure(found.calibration.name, measured, fitted)
    maps = None if true is None else workspace_map(arm, found.calibration, mass)
    if maps is not None:
        drawn |= {f"map_{name}": workspace_map_figure(maps, key, words) for key, name in QUANTITIES.items()}
    return drawn


async def _agreed_jogs(
    client: Robot, plan: JogPlan, picture: Path, step: Progress, *, sure: bool
) -> RingDownLogs:
    """Show the moves, ask for consent, and make them."""
    from tvist_lab.figures import house_style, move_plan_figure, save

    with house_style():
        save(move_plan_figure(plan), picture)
    _show(plan, picture)
    if not sure:
        say("Is there nothing in the way, and somebody at the emergency stop? Move the arm [y/N]")
        if (await asyncio.to_thread(sys.stdin.readline)).strip().lower() not in {"y", "yes"}:
            raise Failure("nothing was moved")
    stops: list[str | None] = []
    client.on_event(lambda event: stops.append(event.why) if event.kind.endswith("_stop") else None)
    async with client.control("identify") as control:
        await _ready(client, control, plan)
        try:
            return await make_jogs(client, control, plan, step)
        except (RefusedError, MotionStoppedError) as error:  # a stop before it is the reason
            raise Failure(f"the moves were not finished: {stops[-1] if stops else error}") from error


async def _ready(client: Robot, control: Arm, plan: JogPlan) -> None:
    """Wait until the program on the robot follows; test this with a move to the arm's present position."""
    say("starting the program on the robot")
    deadline = asyncio.get_running_loop().time() + READY
    while True:
        state = await client.state()
        try:
            if state.robot_mode == RobotMode.RUNNING:
                if max(abs(q - there) for q, there in zip(state.target_q, plan.at, strict=True)) > MOVED:
                    raise Failure(
                        "the arm was moved since the moves were planned: nothing was moved, begin again"
                    )
                await control.move_j(state.target_q, velocity=plan.ways.velocity)
                return
            await control.power_on()
        except RefusedError as error:
            if error.reply.code != "wrong_mode" or asyncio.get_running_loop().time() > deadline:
                raise Failure(f"the robot does not follow: {error}") from error
        await client.advance(50)


def _show(plan: JogPlan, picture: Path) -> None:
    """Print the moves on stderr, where the question also appears."""
    rows = [
        (str(number), " → ".join(map(angles, jog.way)), angles(jog.q))
        for number, jog in enumerate(plan.jogs, 1)
    ]
    table("the moves", ("ring-down", "goes to rad", "rings at rad"), rows, on=err)
    assert plan.turned is not None, "the plan is that of a robot that takes positions alone"
    say(
        f"First the last joint turns to {plan.turned[-1]:.2f} rad and back, twice. All ways were checked for "
        "collisions of the arm with itself and the floor, not with what else stands around it."
    )
    say(
        f"No joint is faster than {plan.speed:.2f} rad/s; it takes about {plan.seconds:.0f} s. Drawn in {picture}"
    )
