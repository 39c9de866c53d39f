"""Identify the robot at an address: start the server that moves it, show the moves, ask, make them and report."""

import asyncio
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from tvist_cli.failure import Failure, told
from tvist_cli.identified import angles, report_from_logs
from tvist_cli.output import err, say, table, typed

if TYPE_CHECKING:
    from tvist_client.arm import Arm
    from tvist_client.robot import Robot
    from tvist_lab.identification.modal_plan import ModalPlan
    from tvist_lab.identification.positioned import Moved, MovePlan
    from tvist_plant.description import RobotDescription

READY = 30.0
"""Longest wait for the robot to follow [s]."""
MOVED = 0.01
"""Distance of a joint from where the moves were planned from, from which on they are not made [rad]."""


def identify_robot(
    place: str,
    robot: str,
    mass: float | None,
    ring_downs: int,
    seed: int,
    output: Path,
    name: str,
    *,
    sure: bool,
    json: bool,
) -> None:
    """Identify a robot that takes positions alone.

    Args:
        place: Its address, ur://ADDRESS.
        robot: Name of the robot, or its file.
        mass: Mass of its payload [kg]; None for the robot file's.
        ring_downs: Number of ring-downs.
        seed: Seed of the choice of configurations.
        output: File of the calibration.
        name: Name of the calibration.
        sure: Whether to move without asking.
        json: Whether to print one JSON object.
    """
    from tvist_lab.identification.fit import FitError
    from tvist_lab.identification.modal_plan import ModalPlan
    from tvist_lab.identification.positioned import JOG, identify_moved
    from tvist_lab.served import ServedError, served_robot
    from tvist_plant.description import DescriptionError, load
    from tvist_protocol.calibration import calibration_to_json
    from tvist_server.watching.place import is_place, place_of

    with told(ValueError, DescriptionError, code=2):
        place_of(place if is_place(place) else "")
        arm = load(robot)
    if not (sure or sys.stdin.isatty()):
        raise Failure(
            "the arm is going to move, and there is no terminal to ask you on: look at the moves first on a terminal, "
            "or give --yes",
            code=2,
        )
    options = [
        "--plant",
        place,
        "--enable-motion",
        "--robot",
        robot,
        "--calibration",
        "none",
        "--shaper",
        "none",
    ]
    options += [] if mass is None else ["--payload", f"{mass:g}"]
    picture = output.with_suffix(".moves.png")

    async def moves() -> "tuple[MovePlan, Moved]":
        say(f"starting the server that moves the robot at {place}")
        async with served_robot(options, arm.robot.name) as (client, _):
            return await _moves(
                client, arm, ModalPlan(ring_downs=ring_downs, seed=seed, jog=JOG), picture, sure=sure
            )

    with told(FitError, ServedError, OSError):
        plan, moved = asyncio.run(moves())
        done = identify_moved(plan, moved, name=name, command=typed()[:500], progress=say)
        output.write_bytes(calibration_to_json(done.found.calibration))
    servo = done.servo
    more = {
        "robot_time_s": done.seconds,
        "servo_lag_s": None if servo is None else servo.lag,
        "servo_gain": None if servo is None else servo.gain,
        "servo_delay_s": None if servo is None else servo.delay,
        "picture": str(picture),
    }
    report_from_logs(done.found, output, f" --robot {robot} --plant {place}", json=json, more=more)
    if json:
        return
    if servo is None:
        say("the robot does not follow set-points as a servo with a lag does: nothing compensates it")
    else:
        low, high = (servo.lag * (1.0 + side * 1.96 * servo.errors[0]) for side in (-1.0, 1.0))
        say(
            f"the robot follows {1e3 * servo.lag:.1f} ms late ({1e3 * low:.1f} to {1e3 * high:.1f}), with a gain of "
            f"{servo.gain:.0f} 1/s², and {1e3 * servo.delay:.0f} ms more for the way there and back; it took "
            f"{done.seconds:.0f} s of its time"
        )


async def _moves(
    client: "Robot", arm: "RobotDescription", wanted: "ModalPlan", picture: Path, *, sure: bool
) -> "tuple[MovePlan, Moved]":
    """Plan, show, ask and move as a client."""
    from tvist_client.errors import MotionStoppedError
    from tvist_lab.figures import house_style, move_plan_figure, save
    from tvist_lab.identification.positioned import make_moves, plan_moves
    from tvist_protocol.errors import RefusedError

    say("planning the moves")
    plan = await plan_moves(client, arm, wanted)
    with house_style():
        save(move_plan_figure(plan), picture)
    _show(plan, picture)
    if not sure and not await asyncio.to_thread(_agreed):
        raise Failure("nothing was moved")
    stops: list[str | None] = []
    client.on_event(lambda event: stops.append(event.why) if event.kind.endswith("_stop") else None)
    async with client.control("identify") as control:
        await _ready(client, control, plan)
        try:
            return plan, await make_moves(client, control, plan, say)
        except (RefusedError, MotionStoppedError) as error:  # the stop says why, what came after it does not
            raise Failure(f"the moves were not finished: {stops[-1] if stops else error}") from error


async def _ready(client: "Robot", control: "Arm", plan: "MovePlan") -> None:
    """Wait until the program on the robot follows, which shows by a move to where the arm stands."""
    from tvist_protocol.errors import RefusedError
    from tvist_protocol.modes import RobotMode

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


def _show(plan: "MovePlan", picture: Path) -> None:
    """Print the moves on stderr, where the question stands, too."""
    rows = [
        (str(number), " → ".join(map(angles, jog.way)), angles(jog.q))
        for number, jog in enumerate(plan.jogs, 1)
    ]
    table("the moves", ("ring-down", "goes to rad", "rings at rad"), rows, on=err)
    say(
        f"First the last joint turns to {plan.turned[-1]:.2f} rad and back, twice. All ways were checked for "
        "collisions of the arm with itself and the floor, not with what else stands around it."
    )
    say(
        f"No joint is faster than {plan.speed:.2f} rad/s; it takes about {plan.seconds:.0f} s. Drawn in {picture}"
    )


def _agreed() -> bool:
    say("Is there nothing in the way, and somebody at the emergency stop? Move the arm [y/N]")
    return sys.stdin.readline().strip().lower() in ("y", "yes")
