"""Robots that run programs in URScript, for the tests."""

from tvist_protocol.programs import ProgramRun

from .robots import Robot

URSIM = (-1.60, -1.727, -2.203, -0.808, 1.595, -0.031)
"""A posture away from singular ones, with room around it."""


def script(*lines: str, name: str = "prog") -> str:
    return "\n".join((f"def {name}():", *(f"  {line}" for line in lines), "end", ""))


def a_robot(**changes) -> Robot:
    """A robot in a posture with room for moves."""
    return Robot(**({"q": URSIM, "shaper": "none"} | changes))


def start(robot: Robot, *lines: str, name: str = "prog"):
    """Send a program; return the reply."""
    return robot.send(ProgramRun, text=script(*lines, name=name))


def playing(robot: Robot) -> bool:
    return robot.controller.programs.state == "PLAYING"


def finish(robot: Robot, most: int = 20_000) -> Robot:
    """Tick until the program has ended or is paused."""
    robot.until(lambda: not playing(robot), most)
    return robot


def run(robot: Robot, *lines: str) -> Robot:
    start(robot, *lines)
    return finish(robot)


def said(robot: Robot) -> list[str]:
    return [event.why for event in robot.told("text")]


def failure(robot: Robot):
    """Return the event of the error that ended a program, or None."""
    found = [event for event in robot.told("warning") if event.line is not None]
    return found[-1] if found else None
