"""Stops, pauses and the speed slider on paths in space, compared with the same motion left alone."""

import numpy as np
import pytest

from tvist_controller.ahead import resting_after
from tvist_controller.collision import CLEARANCE, CollisionModel
from tvist_controller.safety import TORQUE_SHARE
from tvist_controller.setup import body
from tvist_lab.safety.stops import KINDS, PAUSES, SHAPERS
from tvist_lab.safety.subject import torques
from tvist_protocol import commands as c

from .paths import Progress, journey
from .robots import UR5E, H
from .spaces import errors

QUICK, ALL = 24, 500


@pytest.mark.parametrize("seed", range(QUICK))
def test_every_kind_of_stop_stays_on_the_path_behind_the_motion_and_rests_no_later(seed):
    stopped_as_promised(seed)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(QUICK, ALL))
def test_so_do_many_more(seed):
    stopped_as_promised(seed)


def stopped_as_promised(seed):
    trip = journey([seed, 41], SHAPERS)
    random = np.random.default_rng([seed, 42])
    alone = Progress(trip.begin())
    alone.until_rest()
    alone.tick(200)
    free = np.array(alone.robot.references)
    moment = int(random.integers(1, max(resting_after(free), 2)))
    kind = str(random.choice(list(KINDS)))
    case = (seed, kind, trip.shaper, moment)
    stop = Progress(trip.begin())
    stop.tick(moment)
    stop.robot.events.clear()
    KINDS[kind](stop.robot, random)
    stop.until_rest()
    stop.tick(100)
    q = np.array(stop.robot.references)
    longest = max(len(free), len(q))
    covered, ahead = (np.pad(one.covered, (0, longest - len(one.covered)), "edge") for one in (stop, alone))
    assert (covered - ahead)[moment:].max() <= 1e-9, case
    assert resting_after(q) <= resting_after(free), case
    off, turned = errors(q[:: max(len(q) // 200, 1)], trip.legs)
    assert off <= 5e-5, case
    assert turned <= 1e-4, case
    keeps_limits(q[moment - 1 :], free[moment - 1 :], trip.payload, case)
    if kind not in PAUSES:
        event = next(event for event in stop.robot.events if event.kind == "motion_stopped")
        if event.duration is not None:
            assert event.duration == pytest.approx(max(resting_after(q) - moment, 0) * H, abs=3 * H), case


def keeps_limits(q, free, payload, case):
    """Torque, acceleration and clearance after a stop, in comparison with the motion that was left alone."""
    most = TORQUE_SHARE * np.array(UR5E.limits.torque)
    asked, taken = (np.abs(torques(UR5E, payload, each)).max(axis=0) for each in (free, q))
    assert (taken / np.maximum(most, asked)).max() <= 1.001, case
    present = np.abs(np.diff(free, 2, axis=0)).max() / H**2
    hardest = np.abs(np.diff(q, 2, axis=0)).max() / H**2
    assert hardest <= max(1.01 * min(UR5E.limits.acceleration), present), case
    assert CollisionModel(UR5E, body(payload)).nearest(q) >= CLEARANCE, case


@pytest.mark.parametrize("seed", range(8))
def test_slider_and_pauses_stay_on_the_path_and_lead_to_its_end(seed):
    trip = journey([seed, 43], [name for name in SHAPERS if not name.startswith("um_")])
    random = np.random.default_rng([seed, 44])
    robot = trip.begin()
    for _ in range(12):
        robot.tick(int(random.integers(1, 200)))
        match int(random.integers(4)):
            case 0:
                robot.send(c.SetSpeed, fraction=float(random.uniform(0.05, 1.0)))
            case 1:
                robot.send(c.Pause)
            case 2:
                robot.send(c.Resume)
            case _:
                robot.send(c.SetShaper, name=str(random.choice(["none", "zv", "zvd", "auto"])))
    robot.send(c.Resume)
    robot.send(c.SetSpeed, fraction=1.0)
    robot.until_rest(60_000)
    robot.tick(20)
    q = np.array(robot.references)
    off, turned = errors(q[:: max(len(q) // 300, 1)], trip.legs)
    assert off <= 5e-5
    assert turned <= 1e-4
    assert np.abs(np.diff(q, axis=0)).max() / H <= 1.01 * min(UR5E.limits.velocity)
    assert np.abs(np.diff(q, 2, axis=0)).max() / H**2 <= 1.01 * min(UR5E.limits.acceleration)
    assert [event.kind for event in robot.events if event.kind in {"motion_done", "motion_stopped"}] == [
        "motion_done"
    ]
