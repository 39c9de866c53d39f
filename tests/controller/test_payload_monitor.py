"""What the drives add to the feed-forward tells a wrong payload, and nothing else does."""

import re
from types import SimpleNamespace

import numpy as np
import pytest
from tests.controller.robots import Line

from tvist_controller.foresight.collision import CollisionModel
from tvist_controller.line.inverse_dynamics import InverseDynamics
from tvist_controller.line.line_mode import LineMode
from tvist_controller.safety.payload_monitor import TOLERATED, PayloadMonitor
from tvist_controller.setup import body, paper_payload
from tvist_controller.trajectory import MotionLimits
from tvist_lab.in_process import free_setup, robot_in_process
from tvist_plant.arm_memory import LAST, NOW, parts
from tvist_plant.description import load
from tvist_shaping.catalogue import shaper
from tvist_shaping.estimators.fixed import Fixed
from tvist_shaping.filter import TvistFilter

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

    def carry(self, payload):
        """Grip a part: the arm moves on as it was, with another body on its flange."""
        arm = self.cycle.plant
        before = parts(arm.memory)
        kept = [before[number].copy() for number in range(2)]  # state and commands
        arm._load(payload)
        for number, values in enumerate(kept):
            arm._arm[number][:] = values
        arm._evaluate()
        arm._arm.dynamics[LAST] = arm._arm.dynamics[NOW]

    def move(self, q, limits=LIMITS):
        """Warnings of a motion, of which the next begins at once."""
        self.cycle.begin(self.cycle.plan(q, limits))
        said = []
        while not self.cycle.mode.at_rest:
            said.append(self.step())
        return [warning for warning in said if warning]


def limits_of(rng):
    return MotionLimits(*[(0.5, 1.0, 50.0), (1.5, 2.0, 100.0), (3.0, 8.0, 500.0)][rng.integers(3)])


def test_two_kilograms_declared_and_five_carried_are_told_on_the_paper_s_way():
    watched = Watched(PAPER[0], 2.0, 5.0)
    said = [warning for q in PAPER[1:] for warning in watched.move(q)]
    assert len(said) == 1  # once is enough
    assert "2 kg are declared" in said[0]
    mass, bound = watched.monitor.excess
    assert mass == pytest.approx(3.0, abs=bound)


def test_the_right_payload_on_the_paper_s_way_is_not_told_of():
    watched = Watched(PAPER[0], 5.0, 5.0)
    assert not [warning for q in PAPER[1:] for warning in watched.move(q)]
    assert watched.worst < 0.5


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


def test_too_much_declared_is_told_as_well():
    watched = Watched(PAPER[0], 5.0, 1.0)
    said = [warning for q in PAPER[1:] for warning in watched.move(q)]
    assert len(said) == 1
    assert watched.monitor.excess[0] < -2.0


def test_a_tenth_of_the_payload_is_no_mistake():
    for declared in (4.5, 5.5):
        watched = Watched(PAPER[0], declared, 5.0)
        assert not [warning for q in PAPER[1:] for warning in watched.move(q)]


def test_it_is_told_at_rest_where_gravity_has_a_lever_and_not_upright():
    stretched = Watched(PAPER[0], 2.0, 5.0)
    assert any(stretched.step() for _ in range(1000))
    up = np.array([0.0, -np.pi / 2, 0.0, -np.pi / 2, 0.0, 0.0])
    upright = Watched(up, 2.0, 5.0)
    assert not any(upright.step() for _ in range(1000))


@pytest.mark.parametrize(("declared", "picked"), [(0.0, 5.0), (2.0, 5.0), (0.0, 1.5), (5.0, 0.5)])
def test_a_part_picked_up_is_told_with_its_whole_mass_and_what_to_declare(declared, picked):
    watched = Watched(PAPER[0], declared, declared)
    assert not any(watched.step() for _ in range(2000))
    watched.carry(disc(picked))
    (said,) = [warning for q in PAPER[1:] for warning in watched.move(q)]
    felt, bound = map(float, re.search(r"about ([\d.]+) kg \(within ([\d.]+) kg\)", said).groups())
    assert felt == pytest.approx(picked, abs=bound)
    assert f"set_payload({felt:.1f}, …) or set_target_payload({felt:.1f}, …)" in said


def test_a_new_declaration_starts_anew():
    watched = Watched(PAPER[0], 2.0, 5.0)
    assert watched.move(PAPER[1])
    watched.cycle.dynamics.declare(disc(5.0))
    watched.monitor.declare(disc(5.0), 1)
    assert watched.monitor.excess == (0.0, np.inf)
    assert not watched.move(PAPER[2])
    watched.cycle.dynamics.declare(disc(1.0))
    watched.monitor.declare(disc(1.0), 1)
    assert watched.move(PAPER[3]) or watched.move(PAPER[0])


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


@pytest.mark.parametrize("seed", range(20))
def test_no_warning_names_an_interval_that_holds_what_is_declared(seed):
    """Whatever the drives feel: nothing, far more, less than no payload at all, or another mass from one moment on."""
    random = np.random.default_rng([seed, 54])
    mass = float(random.choice([0.0, random.uniform(0.0, 5.0)]))
    monitor = PayloadMonitor(ROBOT, disc(mass), follows=bool(random.random() < 0.2))
    with_a_kilogram, dynamics = (InverseDynamics(ROBOT, disc(mass + more)) for more in (1.0, 0.0))
    q, still, felt = random.uniform(-np.pi, np.pi, 6), np.zeros(6), 0.0
    for tick in range(3000):
        if tick % 500 == 0:
            q, felt = random.uniform(-np.pi, np.pi, 6), float(random.choice([0.0, 10.0 * random.normal()]))
            per_kg = with_a_kilogram.gravity(q) - dynamics.gravity(q)
        signals = np.array([q, q, *[still] * 7])
        moment = felt * per_kg + 3.0 * random.normal(size=6)
        sample = SimpleNamespace(
            signals=signals, command=SimpleNamespace(torque=still), measured=SimpleNamespace(moment=moment),
            mode=LineMode.REST,
        )  # fmt: skip
        found = monitor.look(sample)
        if found is not None:
            said = found.why
            declared, holds, less, within = re.search(
                r"^([\d.e-]+) kg are .* hold (?:about )?([\d.]+) kg( less)? \(within ([\d.]+) kg\)", said
            ).groups()
            off = float(holds) if less else abs(float(holds) - float(declared))
            assert off > float(within), said
