"""Carry out the requests of tabs, including a comparison of a motion without and with a shaper."""

import asyncio
import contextlib
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from tvist_client.arm import Arm
from tvist_client.errors import ClientError
from tvist_client.robot import Robot
from tvist_protocol.errors import ProtocolError, RefusedError
from tvist_protocol.info import Info
from tvist_protocol.stream import Event, State, Truth
from tvist_view import tab_messages
from tvist_view.described import usual
from tvist_view.look import Look
from tvist_view.pilot import Pilot, carry, declare, go, motion
from tvist_view.signals import moves, signals_of

REST = 500  # ticks recorded after a motion; half as many pass at rest before the motion
POINTS = 600  # points of a curve on the page


@dataclass
class MotionRecord:
    """Everything that the robot published during one motion."""

    states: list[State] = field(default_factory=list)
    truths: list[Truth] = field(default_factory=list)
    events: list[Event] = field(default_factory=list)


Verdict = Mapping[str, float | None]
"""Change of the largest acceleration after the stop [m/s²] and of the time to rest; None if not measurable.

Keys: `before`, `after`, `less_percent`, `earlier_ms`.
"""
Judge = Callable[[MotionRecord, MotionRecord], Verdict]  # compares a motion without and with the shaper


@contextlib.contextmanager
def _gathered(robot: Robot) -> Iterator[MotionRecord]:
    run = MotionRecord()
    with contextlib.ExitStack() as ends:
        ends.callback(robot.on_state(run.states.append))
        ends.callback(robot.on_truth(run.truths.append))
        ends.callback(robot.on_event(run.events.append))
        yield run


def _curves(look: Look, *runs: MotionRecord) -> dict[str, Any]:
    """Return |α| of both motions over time since each started, and when the first one's reference stopped."""
    signals = [signals_of(look, run.states, {truth.tick: truth for truth in run.truths}) for run in runs]
    spans = [moves(one) or (one.time[0], one.time[0]) for one in signals]
    shown = [one.between(begun, one.time[-1]) for one, (begun, _) in zip(signals, spans, strict=True)]
    grid = np.linspace(0.0, max(one.time[-1] - one.time[0] for one in shown), POINTS)
    curves = np.zeros((len(shown), POINTS))
    for curve, one in zip(curves, shown, strict=True):
        # Take the largest value in each step, so that no peak is lost between two points.
        steps = np.searchsorted(grid, one.time - one.time[0]).clip(0, POINTS - 1)
        np.maximum.at(curve, steps, np.nan_to_num(one.alpha))
    without, shaped = np.round(curves, 4).tolist()
    stop = round(float(spans[0][1] - spans[0][0]), 4)
    return {"stop": stop, "time": np.round(grid, 4).tolist(), "without": without, "shaped": shaped}


@dataclass
class RequestHandler:
    """Moves one robot as its tabs request."""

    robot: Robot
    look: Look
    pilot: Pilot
    judge: Judge
    say: Callable[[str], None]  # shows a message in all tabs
    result: Callable[[dict[str, Any]], None]  # shows the result of a comparison in all tabs
    comparing: str | None = None  # present step of a comparison, in words; None if there is none

    async def do(self, info: Info, tab: int, message: tab_messages.Message) -> None:
        """Carry out a tab's request."""
        pilot = self.pilot
        match message:
            case tab_messages.Stop():
                await pilot.stop()
            case tab_messages.Take():
                await pilot.take(tab)
            case tab_messages.Give():
                await pilot.give_back(tab)
            case tab_messages.Move() | tab_messages.Compare():
                await self._go(info, tab, message)
            case tab_messages.Carry(mass):
                pilot.do(tab, lambda arm: carry(arm, mass))
            case tab_messages.Jog(joint):
                self.say(f"joint is {joint}: must be 0 to {len(info.joints) - 1}")
            case _:
                await self._change(info, tab, message)

    async def _change(self, info: Info, tab: int, message: tab_messages.Message) -> None:
        """Change a setting, also while the arm moves."""
        pilot = self.pilot
        match message:
            case tab_messages.Shape(shaper, modes):
                if await pilot.take(tab):
                    await pilot.set(tab, lambda arm: arm.set_shaper(shaper, modes=modes or info.modes))
            case tab_messages.Speed(fraction):
                await pilot.set(tab, lambda arm: arm.set_speed(fraction))
            case tab_messages.Declare(mass):
                await pilot.set(tab, lambda arm: declare(arm, mass))
            case tab_messages.Fault(name):
                await pilot.set(tab, lambda arm: arm.inject(name))
            case tab_messages.Ready():
                if await pilot.take(tab):
                    await pilot.set(tab, pilot.make_ready)

    async def _go(self, info: Info, tab: int, message: tab_messages.Move | tab_messages.Compare) -> None:
        ends = message.first, message.last
        if unknown := [name for name in ends if name not in info.poses]:
            self.say(f"the robot has no pose {unknown[0]}: choose one of {', '.join(info.poses)}")
        elif await self.pilot.take(tab):
            if isinstance(message, tab_messages.Move):
                self.pilot.do(tab, lambda arm: motion(arm, [info.poses[name] for name in ends]))
            else:
                self.pilot.do(tab, lambda arm: self._compare(arm, message))

    async def _compare(self, arm: Arm, message: tab_messages.Compare) -> None:
        """Make a motion without and with a shaper, show both and their comparison, and restore the shaper."""
        info = await self.robot.info()
        shaper = message.shaper if message.shaper not in {"", "none"} else usual(info)
        runs = []
        try:
            for name, words in (("none", "without"), (shaper, f"with {shaper}")):
                self.comparing = f"{words}: to the start …"
                await motion(arm, [info.poses[message.first]])
                await self.robot.advance(REST // 2)
                await arm.set_shaper(name, modes=info.modes)
                self.comparing = f"{words} …"
                with _gathered(self.robot) as gathered:
                    await go(arm, info.poses[message.last])
                    await self.robot.advance(REST)
                runs.append(gathered)
            verdict = await asyncio.to_thread(self.judge, *runs)
            shown = {"with": shaper, "poses": [message.first, message.last], **_curves(self.look, *runs)}
            self.result({**verdict, **shown})
        finally:
            self.comparing = None
            with contextlib.suppress(RefusedError, ClientError, ProtocolError):  # the robot may be gone
                await arm.set_shaper(info.shaper, modes=info.modes)
