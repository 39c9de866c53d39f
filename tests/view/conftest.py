"""Runs that several files draw."""

import asyncio

import pytest

from tvist_lab.in_process import run_beside
from tvist_plant.description import load
from tvist_view.look import Look
from tvist_view.track import ShownRobot, Track

POSES = load("ur5e").poses


@pytest.fixture(scope="module")
def tracks():
    """Q1 to Q2, unshaped and shaped."""
    found = []
    for shaper in ("none", "zv"):
        info, collected = asyncio.run(run_beside(shaper, (POSES["Q1"], POSES["Q2"])))
        label = "without" if shaper == "none" else f"with {shaper}"
        look = Look(info.geometry, info.payload)
        found.append(Track(ShownRobot(label, look), collected.states, collected.truths))
    return found
