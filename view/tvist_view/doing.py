"""Does what a tab asks for."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from tvist_client.robot import Robot
from tvist_protocol.info import Info
from tvist_view import asked
from tvist_view import pilot as piloting
from tvist_view.beside import Judge, beside
from tvist_view.described import usual
from tvist_view.look import Look
from tvist_view.pilot import Pilot


@dataclass
class Doer:
    """Moves one robot as its tabs ask.

    Attributes:
        comparing: What a comparison does now, in words; None: there is none.
    """

    robot: Robot
    look: Look
    pilot: Pilot
    judge: Judge
    say: Callable[[str], None]
    """Says a sentence to all tabs."""
    result: Callable[[dict[str, Any]], None]
    """Shows the result of a comparison to all tabs."""
    comparing: str | None = None

    async def do(self, info: Info, tab: int, message: asked.Message) -> None:
        """Do what a tab asks for."""
        pilot = self.pilot
        match message:
            case asked.Stop():
                await pilot.stop()
            case asked.Take():
                await pilot.take(tab)
            case asked.Give():
                await pilot.give_back(tab)
            case asked.Move() | asked.Compare():
                await self._go(info, tab, message)
            case asked.Carry(mass):
                pilot.do(tab, piloting.carry(mass))
            case asked.Setting():
                if not isinstance(message, asked.Shape | asked.Ready) or await pilot.take(tab):
                    await pilot.set(tab, _setting(pilot, info, message))
            case asked.Jog(joint):
                self.say(f"joint is {joint}: the robot has {len(info.joints)} joints, from 0")

    async def _go(self, info: Info, tab: int, message: asked.Move | asked.Compare) -> None:
        unknown = [name for name in (message.first, message.last) if name not in info.poses]
        if unknown:
            self.say(f"the robot has no pose {unknown[0]}: it has {', '.join(info.poses)}")
        elif await self.pilot.take(tab):
            self.pilot.do(tab, self._moving(info, message))

    def _moving(self, info: Info, message: asked.Move | asked.Compare) -> piloting.Doing:
        poses = [info.poses[message.first], info.poses[message.last]]
        if isinstance(message, asked.Move):
            return piloting.motion(poses)
        shaper = message.shaper if message.shaper not in {"", "none"} else usual(info)

        def tell(words: str | None) -> None:
            self.comparing = words

        def done(result: dict[str, Any]) -> None:
            self.result({**result, "poses": [message.first, message.last]})

        return beside(self.robot, self.look, poses, shaper, self.judge, tell, done)


def _setting(pilot: Pilot, info: Info, message: asked.Setting) -> piloting.Doing:
    """What changes a setting as a tab asks."""
    match message:
        case asked.Shape(shaper, modes):
            return lambda arm: arm.set_shaper(shaper, modes=modes or info.modes)
        case asked.Speed(fraction):
            return lambda arm: arm.set_speed(fraction)
        case asked.Declare(mass):
            return piloting.declare(mass)
        case asked.Fault(name):
            return lambda arm: arm.inject(name)
        case _:
            return pilot.make_ready
