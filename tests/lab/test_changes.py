"""A change of the arm during a recording is reported soon, with the motion after which it is visible."""

import re
from functools import partial
from types import SimpleNamespace

import numpy as np
import pytest

from tvist_controller.api.line import Setup, body, paper_payload
from tvist_controller.api.robot import Controller
from tvist_lab.metrics import MeasuredRecording, changes, motions
from tvist_lab.metrics.change_detector import ChangeDetector
from tvist_lab.metrics.changes import GEAR, MASS, MODES, _of_gear, _of_mass, _of_modes
from tvist_lab.recordings import Recording
from tvist_lab.workspace import WORKSPACE
from tvist_plant.description import load
from tvist_plant.flexible_arm import FlexibleArm
from tvist_plant.plant import Measurement
from tvist_plant.variants import hidden, hidden_payload, stiffer
from tvist_protocol.commands import MoveJ, TakeControl
from tvist_protocol.replies import Accepted

COLUMNS = (
    "tick", "timestamp", "reference_q", "target_q", "actual_q", "actual_moment", "target_moment",
    "actual_tool_accelerometer",
)  # fmt: skip
UR5E = load("ur5e")
GEAR_TEETH = 24 * 101  # waves of the torque's ripple per turn of a joint


class ChangingArm:
    """A hidden robot with torque constants off by 5 %, ripple, and a payload and springs that can change at rest."""

    def __init__(self, said, seed):
        random = np.random.default_rng([seed, 67])
        self.payload, self._seed = said, seed
        self._gains = 1.0 + random.uniform(-0.05, 0.05, UR5E.joints)
        self._phases = random.uniform(0.0, 2.0 * np.pi, UR5E.joints)
        self._arm = FlexibleArm(hidden(UR5E, seed), hidden_payload(said, seed))

    def change(self, mass, springs):
        carried = hidden_payload(body(paper_payload(UR5E, self.payload.mass + mass)), self._seed)
        self._arm = FlexibleArm(stiffer(springs, hidden(UR5E, self._seed)), carried)
        self._arm.reset(self._last, seed=self._seed)

    def reset(self, command, *, seed=0, **_):
        self._last = command
        return self._read(self._arm.reset(command, seed=seed))

    def step(self, command):
        self._last = command
        return self._read(self._arm.step(command))

    def _read(self, measured):
        ripple = 0.01 * np.array(UR5E.limits.torque) * np.sin(GEAR_TEETH * measured.q + self._phases)
        moment = self._gains * measured.moment + ripple
        return Measurement(measured.q, measured.qd, moment, measured.accelerometer)


PICKED_UP, SOFTER, MOTIONS = 8, 10, 14
"""Numbers of motions before the arm has another payload, before its springs are softer, and in all."""


@pytest.fixture(scope="module")
def recorded():
    """Random motions of a hidden robot without a shaper, which changes twice between them."""
    random, declared, states = np.random.default_rng([4, 73]), paper_payload(UR5E, 1.7), []
    arm = ChangingArm(body(declared), seed=4)
    setup = Setup(
        description=UR5E, q=UR5E.poses["Q1"], payload=declared, calibration=None, shaper="none", clock="free", seed=4,
    )  # fmt: skip
    controller = Controller(setup, arm)
    token = controller.receive(TakeControl(client="worker")).token

    def ask():
        here = np.array(controller.latest.reference_q)
        away = random.uniform([*WORKSPACE.low, -2.0, -2.0], [*WORKSPACE.high, 2.0, 2.0]) - here
        q = tuple((here + random.uniform(0.3, 1.0) * away).tolist())
        return controller.receive(MoveJ(token=token, q=q, velocity=2.5, acceleration=4.0, jerk=200.0))

    for number in range(MOTIONS):
        if number == PICKED_UP:
            arm.change(mass=2.0, springs=1.0)
        if number == SOFTER:
            arm.change(mass=2.0, springs=0.6)
        while not isinstance(ask(), Accepted):
            pass
        states.append(controller.tick()[0])
        while not controller.cycle.mode.at_rest:
            states.append(controller.tick()[0])
        states += [controller.tick()[0] for _ in range(int(random.integers(150, 200)))]
    columns = {name: np.array([getattr(state, name) for state in states], dtype=float) for name in COLUMNS}
    recording = Recording(columns, (), SimpleNamespace(model="UR5e", payload=controller.declared))
    found = motions(recording)
    assert len(found) == MOTIONS
    return MeasuredRecording(recording, found, [])


def changes_until(recorded, number):
    return changes(MeasuredRecording(recorded.recording, recorded.motions[:number], []))


def test_undeclared_payload_is_reported_with_its_mass(recorded):
    (mass,) = [one for one in changes_until(recorded, SOFTER) if "kg" in one]
    number, more = re.match(r"After motion (\d+), the arm carries about ([\d.]+) kg more", mass).groups()
    assert int(number) in (9, 10)
    assert float(more) == pytest.approx(2.0, abs=0.6)


def test_softer_gears_are_reported(recorded):
    said = [one for one in changes_until(recorded, MOTIONS) if "the gear of the " in one]
    assert said
    assert all(int(re.match(r"After motion (\d+),", one)[1]) > SOFTER and "% softer" in one for one in said)


def test_unchanged_arm_gives_no_report(recorded):
    assert changes_until(recorded, PICKED_UP) == []


def by_hand(f_d, poses):
    """A log of another controller: a stop in each pose, which rings so."""
    rows = np.arange(len(f_d), dtype=float)
    q = np.array([[pose, 0.0, 0.0, 0.0, 0.0, 0.0] for pose in poses])
    recording = Recording({"tick": rows, "timestamp": rows, "actual_q": q}, foreign=True)
    found = [SimpleNamespace(end=row + 1) for row in range(len(f_d))]
    intervals = [None if f is None else (0.99 * f, 1.01 * f) for f in f_d]
    results = [
        SimpleNamespace(f_d_hz=f, f_d_interval_hz=within) for f, within in zip(f_d, intervals, strict=True)
    ]
    return changes(MeasuredRecording(recording, found, results))


def test_stops_of_a_foreign_log_are_compared_in_equal_poses_only():
    f_d = np.where(np.arange(24) % 2, 12.0, 8.1)
    assert by_hand(f_d, np.arange(24) % 2) == []
    f_d[12::2] = 7.3
    (said,) = by_hand(f_d, np.arange(24) % 2)
    assert said.startswith(
        "After motion 15, 7.3 Hz ring after the last 2 stops in this pose, and 8.1 Hz did before"
    )
    assert by_hand([8.0] * 4 + [None] * 4, np.zeros(8)) == []
    assert by_hand([8.0, 6.0] * 4, np.arange(8.0)) == []


SCATTER = 0.05


def told(values, errors=0.02):
    detector = ChangeDetector(1.0, SCATTER, 0.1)
    pairs = zip(np.asarray(values).tolist(), np.broadcast_to(errors, len(values)).tolist(), strict=True)
    return [
        (number, change) for number, pair in enumerate(pairs) if (change := detector.take(*pair)) is not None
    ]


@pytest.mark.parametrize("tails", ["normal", "heavy"])
def test_false_alarms_are_at_most_one_in_a_hundred_motions(tails):
    random, alarms = np.random.default_rng(3), 0
    for _ in range(20):
        noise = 2.0 * random.normal(size=30) if tails == "normal" else random.standard_t(3, size=30)
        alarms += len(told(random.normal() + SCATTER * noise))
    assert alarms <= 6


@pytest.mark.parametrize("shift", [-0.4, 0.4])
def test_change_is_detected_within_three_motions_with_its_size(shift):
    for seed in range(20):
        random = np.random.default_rng(seed)
        values = 0.7 + SCATTER * random.normal(size=13) + shift * (np.arange(13) >= 10)
        ((number, change),) = told(values)
        assert number in (10, 11, 12)
        assert change.after - change.before == pytest.approx(shift, abs=4.0 * change.error)


def test_outlier_uncertain_value_and_small_change_are_ignored():
    values = SCATTER * np.random.default_rng(5).normal(size=30)
    values[15] = 20.0
    assert not told(values)
    assert not told([0.0] * 10 + [0.4] * 2, [0.02] * 10 + [0.3] * 2)
    assert not told(np.repeat([0.0, 0.09], 10), errors=1e-6)


def test_change_back_is_detected():
    values = np.repeat([0.0, 0.5, 0.0], 10)
    assert [round(change.after - change.before, 2) for _, change in told(values)] == [0.5, -0.5]


def test_interval_of_a_reported_change_excludes_zero():
    random, said = np.random.default_rng([0, 54]), []
    for arguments, tell in ((MASS, _of_mass), (GEAR, partial(_of_gear, joint="elbow")), (MODES, _of_modes)):
        for _ in range(25):
            one, count = ChangeDetector(*arguments), int(random.integers(5, 30))
            errors = arguments[1] * 10 ** random.uniform(-1.5, 1.2, count)
            shift = random.choice([-1, 1]) * 10 ** random.uniform(-1.5, 0.7)
            values = errors * random.standard_t(3, size=count) + shift * (np.arange(count) >= count // 2)
            found = map(one.take, values.tolist(), errors.tolist())
            said += [tell(change) for change in found if change is not None]
    assert said
    for one in said:
        size, within = re.search(r"([\d.]+) (?:kg|%) .*\(within ([\d.]+) (?:kg|%)\)", one).groups()
        assert float(size) > float(within) or float(size) == float(within) == 0.0, one
