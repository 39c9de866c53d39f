"""What the drives add to the feed-forward tells a wrong payload, and nothing else does."""

import numpy as np
import pytest

from tvist_controller.foresight.collision import CollisionModel
from tvist_controller.safety.payload_monitor import TOLERATED, PayloadMonitor
from tvist_controller.setup import body, paper_payload
from tvist_controller.trajectory import MotionLimits
from tvist_lab.in_process import free_setup, robot_in_process
from tvist_plant.description import load
from tvist_shaping.catalogue import shaper
from tvist_shaping.estimators.fixed import Fixed
from tvist_shaping.filter import TvistFilter

from .robots import Line

ROBOT = load("ur5e")
LIMITS = MotionLimits(1.5, 2.0, 100.0)
PAPER = [np.array(ROBOT.poses[name]) for name in ("Q1", "Q2", "Q1", "Q3")]


def disc(mass):
    return body(paper_payload(ROBOT, mass))


def random_poses(rng, count):
    """Free ones, all over the workspace and with the wrists free."""
    model, found = CollisionModel(ROBOT, disc(5.0)), []
    while len(found) < count:
        q = rng.uniform([-np.pi, -np.pi, -2.6, -np.pi, -3, -3], [np.pi, 0, 2.6, 0, 3, 3])
        if model.meeting(q) is None:
            found.append(q)
    return found


class Watched:
    """A cycle and a monitor that looks on."""

    def __init__(self, q, declared, carried, description=ROBOT, seed=0):
        tvist = TvistFilter(shaper("zv"), Fixed([8.0], [0.2]), joints=6)
        self.cycle = Line(description, tvist, q=q, declared=disc(declared), carried=disc(carried), seed=seed)
        self.monitor = PayloadMonitor(description, disc(declared))
        self.worst = 0.0

    def step(self):
        said = self.monitor.look(self.cycle.step())
        mass, bound = self.monitor.excess
        if self.monitor._time > 1.0 and np.isfinite(bound):
            self.worst = max(self.worst, abs(mass) / (TOLERATED + bound))
        return None if said is None else said.why

    def move(self, q, limits=LIMITS):
        """Warnings of a motion, of which the next begins at once."""
        self.cycle.begin(self.cycle.plan(q, limits))
        said = []
        while not self.cycle.mode.at_rest:
            said.append(self.step())
        return [warning for warning in said if warning]


def limits_of(rng):
    return MotionLimits(*[(0.5, 1.0, 50.0), (1.5, 2.0, 100.0), (3.0, 8.0, 500.0)][rng.integers(3)])


def told_and_false(rounds, seed):
    rng = np.random.default_rng(seed)
    missed, false, worst = 0, 0, 0.0
    for number in range(rounds):
        poses, limits = random_poses(rng, 4), limits_of(rng)
        description = ROBOT if number % 3 else ROBOT.clean()
        wrong = Watched(poses[0], 2.0, 5.0, description, number)
        told = [wrong.move(q, limits) for q in poses[1:]]
        missed += not any(told)
        mass = float(rng.uniform(0.0, 5.0))
        right = Watched(poses[0], mass, mass, description, number)
        false += sum(len(right.move(q, limits)) for q in poses[1:])
        worst = max(worst, right.worst)
    return missed, false, worst


@pytest.mark.parametrize(
    "rounds", [5, pytest.param(100, marks=[pytest.mark.nightly, pytest.mark.timeout(1200)])]
)
def test_within_three_random_moves_a_wrong_payload_is_told_and_a_right_one_never(rounds):
    missed, false, worst = told_and_false(rounds, seed=1)
    assert max(missed, false) <= rounds // 100
    assert rounds > 5 or worst < 0.6  # far from a false alarm


@pytest.mark.parametrize(("declared", "told"), [(2.0, 1), (5.0, 0)])
async def test_a_robot_warns_of_it_within_three_moves(declared, told):
    warnings = []
    setup = free_setup(calibration="ur5e_modal")
    async with robot_in_process(setup) as robot, robot.control("test") as arm:
        payload = paper_payload(ROBOT, declared)
        await arm.reset(q=PAPER[0], payload=paper_payload(ROBOT, 5.0))
        await arm.set_payload(payload.mass, payload.com, payload.inertia)
        robot.on_event(lambda event: warnings.append(event) if event.kind == "warning" else None)
        for q in PAPER[1:]:
            await arm.move_j(q)
    assert [event.code for event in warnings] == ["payload_mismatch"] * told
