"""Recorded runs that several test files draw, and a browser."""

import asyncio

import pytest

from tvist_lab.collect import collect
from tvist_lab.in_process import free_setup, robot_in_process, run_beside
from tvist_plant.description import load
from tvist_view.look import Look
from tvist_view.track import Track

from .browser import browser

POSES = load("ur5e").poses


@pytest.fixture(scope="session")
def moved():
    """States and truths of a shaped motion of the flexible arm."""

    async def move():
        async with robot_in_process(free_setup(shaper="zv")) as robot:
            with collect(robot) as collected:
                async with robot.control("test") as arm:
                    await arm.move_j([0.7, -2.5, 0.5, -1.2, 0.3, 0.2])
                    await robot.advance(500)
            return collected

    return asyncio.run(move())


@pytest.fixture(scope="session")
def tracks():
    """Q1 to Q2, unshaped and shaped."""
    found = []
    for shaper in ("none", "zv"):
        info, collected = asyncio.run(run_beside(shaper, (POSES["Q1"], POSES["Q2"])))
        label = "without" if shaper == "none" else f"with {shaper}"
        look = Look(info.geometry, info.payload)
        found.append(Track(label, look, collected.states, collected.truths))
    return found


@pytest.fixture(scope="module")
def chromium():
    """A browser, until the end of a file: playwright suffers no other event loop beside its own."""
    with browser() as started:
        yield started
