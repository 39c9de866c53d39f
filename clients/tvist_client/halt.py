"""Stops one robot, whichever client has control, and reports what was stopped."""

import msgspec

from tvist_client.errors import AnswerTimeoutError
from tvist_client.readiness import mode_name
from tvist_client.robot import Robot
from tvist_protocol import Event, RuntimeState, State


class HaltReport(msgspec.Struct, frozen=True):
    """What was stopped, and whether the arm is at rest."""

    ok: bool  # whether the arm is at rest, or in lockstep will be after the next steps
    endpoint: str
    robot: str  # name of the robot
    stopped: list[str] | None
    """What was stopped, in order, such as "motion 3"; empty if nothing; null in lockstep, where the next step stops."""
    control: str | None  # client that has control and can move the robot again; null if none has
    runtime_state: str | None  # RTDE name of the state afterwards; null in lockstep
    why: str  # what is wrong; empty if all is well


async def halt(robot: Robot, endpoint: str) -> HaltReport:
    """Send `stop` without control and wait until the arm is at rest; `endpoint` is for the report."""
    stopped: list[str] = []
    robot.on_event(lambda event: stopped.extend(_ended(event)))
    robot.watch()
    await robot.stop()
    info, state, why = await robot.info(), None, ""
    if info.clock == "realtime":
        try:
            state = await _rest(robot, info.tick)
        except AnswerTimeoutError:
            why = "it has accepted the stop but publishes no state: check whether it moves"
    if state is not None and state.runtime_state == RuntimeState.PLAYING:
        why = (
            f"it was stopped and moves again: {info.control or 'another client'} has control, end that first"
        )
    return HaltReport(
        ok=not why,
        endpoint=endpoint,
        robot=info.name,
        stopped=stopped if info.clock == "realtime" else None,
        control=info.control,
        runtime_state=None if state is None else mode_name(RuntimeState, state.runtime_state),
        why=why,
    )


async def _rest(robot: Robot, tick: int) -> State:
    """Return the first state after tick `tick` in which no stop is in progress."""
    state = await robot.until(tick + 1)
    while state.runtime_state == RuntimeState.STOPPING:
        state = await robot.until(state.tick + 1)
    return state


def _ended(event: Event) -> list[str]:
    ended = {
        "motion_stopped": f"motion {event.id}",
        "stream_stopped": "the stream of set-points",
        "program_stopped": "a program" if event.program is None else f"the program {event.program}",
    }
    return [ended[event.kind]] if event.kind in ended else []
