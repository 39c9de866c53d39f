"""What changes about an arm in the middle of a recording is told, with the motion after which it shows."""

import re
from types import SimpleNamespace

import numpy as np
import pytest
from tests.lab.changing_arm import Change
from tests.lab.worker import Worker

from tvist_lab.metrics import Measured, changes, motions
from tvist_lab.recordings import Recording

COLUMNS = (
    "tick", "timestamp", "reference_q", "target_q", "actual_q", "actual_moment", "target_moment",
    "actual_tool_accelerometer",
)  # fmt: skip
PEOPLE = "look whether mount, base, a joint or the tool is loose, or whether another tool is on."


def recorded(change, before=8, after=4):
    worker = Worker("ur5e", 4)
    for number in range(before + after):
        if number == before:
            worker.arm.change(change)
        worker.move()
    columns = {
        name: np.array([getattr(state, name) for state in worker.states], dtype=float) for name in COLUMNS
    }
    info = SimpleNamespace(model="UR5e", payload=worker.controller.declared)
    recording = Recording(columns, (), info)
    found = motions(recording)
    assert len(found) == before + after
    return Measured(recording, found, [])


def test_a_payload_that_was_picked_up_is_told_with_its_mass():
    said = changes(recorded(Change(mass=2.0)))
    (mass,) = [one for one in said if "kg" in one]
    number, more = re.match(
        r"After motion (\d+), the arm carries about ([\d.]+) kg more than in", mass
    ).groups()
    assert int(number) in (9, 10, 11)
    assert float(more) == pytest.approx(2.0, abs=0.6)


def test_springs_that_have_become_softer_are_told():
    said = [one for one in changes(recorded(Change(springs=0.7))) if "the gear of the " in one]
    assert said
    assert all(int(re.match(r"After motion (\d+),", one)[1]) > 8 and "% softer" in one for one in said)


def test_of_an_arm_that_stays_as_it_was_nothing_is_told():
    assert changes(recorded(Change(), after=2)) == []


def by_hand(f_d, poses):
    """A log of another controller: a stop in each pose, which rings so."""
    rows = np.arange(len(f_d), dtype=float)
    q = np.array([[pose, 0.0, 0.0, 0.0, 0.0, 0.0] for pose in poses])
    recording = Recording({"tick": rows, "timestamp": rows, "actual_q": q}, foreign=True)
    found = [SimpleNamespace(end=row + 1) for row in range(len(f_d))]
    results = [
        SimpleNamespace(f_d_hz=f, f_d_interval_hz=None if f is None else (0.99 * f, 1.01 * f)) for f in f_d
    ]
    return changes(Measured(recording, found, results))


def test_in_a_foreign_log_stops_in_one_pose_are_compared_with_each_other_alone():
    f_d = np.where(np.arange(24) % 2, 12.0, 8.1)
    assert by_hand(f_d, np.arange(24) % 2) == []
    f_d[12::2] = 7.3
    assert by_hand(f_d, np.arange(24) % 2) == [
        "After motion 15, 7.3 Hz ring after the last 2 stops in this pose, and 8.1 Hz did before: " + PEOPLE
    ]


def test_stops_without_a_frequency_and_poses_seen_rarely_say_nothing():
    assert by_hand([8.0] * 4 + [None] * 4, np.zeros(8)) == []
    assert by_hand([8.0, 6.0] * 4, np.arange(8.0)) == []
