"""Compensation of sag: at rest the arm is at its target, and nothing else changes."""

import numpy as np
import pytest

from tvist_controller.line.line_tick import Q
from tvist_controller.setup import body, paper_payload
from tvist_plant.description import Payload
from tvist_shaping.catalogue import shaper
from tvist_shaping.estimators.fixed import Fixed
from tvist_shaping.filter import TvistFilter

from .robots import PAPER, Q1, Q2, Q3, UR5E, H, Line

CLOSE = 1e-4
"""What is allowed between measured and target angles at rest [rad]."""


def line(description=UR5E, mass=5.0, q=Q1, *, compensated=True, name="none", **changes) -> Line:
    payload = changes.pop("payload", body(paper_payload(description, mass)))
    return Line(
        description,
        TvistFilter(shaper(name), Fixed((10.0,), (0.2,)), joints=description.joints),
        q=np.array(q),
        declared=payload,
        carried=payload,
        seed=0,
        compensate_sag=compensated,
        **changes,
    )


def commands_of(cycle):
    """Return the drive commands from now on, and their references."""
    found, made = [], cycle.drives.command

    def watched(signals, *arguments, **options):
        found.append((made(signals, *arguments, **options), signals[Q]))
        return found[-1][0]

    cycle.drives.command = watched
    return found


def off_target(sample):
    return np.abs(sample.measured.q - sample.target.q).max()


def play(cycle, trajectory, rest=0):
    samples = []
    cycle.begin(trajectory)
    while not cycle.mode.at_rest:
        samples.append(cycle.step())
    return samples + [cycle.step() for _ in range(rest)]


INERTIA = (0.01, 0.0, 0.0, 0.01, 0.0, 0.01)


@pytest.mark.parametrize("arm", [UR5E, UR5E.clean(), UR5E.quiet()], ids=["real", "clean", "quiet"])
def test_sag_compensation_places_a_resting_arm_on_its_target(arm):
    random, sagged = np.random.default_rng(7), 0.0
    compensated, plain = line(arm), line(arm, compensated=False)
    for _ in range(40):
        q, mass = random.uniform(-3.1, 3.1, 6), random.uniform(0, 5)
        payload = Payload(mass=mass, com=tuple(random.uniform(-0.1, 0.1, 3)), inertia=INERTIA)
        for cycle in (compensated, plain):
            cycle.dynamics.declare(payload)
            cycle.reset(q, carried=payload)
        assert off_target(compensated.sample) < CLOSE
        for _ in range(50):
            still = compensated.step()
        assert off_target(still) < CLOSE
        sagged = max(sagged, off_target(plain.sample))
    assert sagged > 10 * CLOSE


@pytest.mark.parametrize(("name", "mass"), [("none", 0.0), ("zv", 5.0)])
def test_sag_compensation_holds_after_a_move_despite_friction(name, mass):
    for start, end in ((Q1, Q3), (Q1, Q2)):
        cycle = line(mass=mass, q=start, name=name)
        samples = play(cycle, cycle.plan(end, PAPER), rest=600)
        assert max(map(off_target, samples[-500:])) < CLOSE


def test_sag_compensation_changes_smoothly_in_motion():
    """The change is 3.3 mrad in two seconds; wind-up feed-forward is the same with and without."""
    leads = []
    for compensated in (True, False):
        cycle = line(compensated=compensated)
        found = commands_of(cycle)
        play(cycle, cycle.plan(Q3, PAPER), rest=10)
        leads.append(np.array([command.q - q for command, q in found]))
    lead = leads[0] - leads[1]
    velocity, acceleration = np.diff(lead, axis=0) / H, np.diff(lead, 2, axis=0) / H**2
    limit = np.array(UR5E.limits.torque) / np.array(UR5E.drives.gear_stiffness)
    assert 2e-3 < np.abs(lead).max() < limit.max()
    assert np.abs(velocity).max() < 0.01
    assert np.abs(acceleration).max() < 0.05
    assert np.abs(np.diff(acceleration, axis=0)).max() < 0.002  # not a step anywhere
    assert not velocity[-5:].any()
