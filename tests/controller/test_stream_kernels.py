"""What streams and their look-ahead compute at every tick, compiled, against its own Python source and others."""

import coal
import numpy as np
import pinocchio as pin
import pytest
from tests.plant.arms import chain

from tvist_controller.foresight import clearance
from tvist_controller.foresight.collision import CLEARANCE, CollisionModel
from tvist_controller.line import differentiator
from tvist_controller.line import limits as line_limits
from tvist_controller.line.differentiator import Target
from tvist_controller.line.inverse_dynamics import InverseDynamics
from tvist_controller.line.limits import TorqueRoom
from tvist_controller.trajectory import JointStop, limiter, stream
from tvist_plant.description import Payload, load

from .robots import PAPER, UR5E, H
from .streams import network, played, swinging, there_and_back

MODULES = (clearance, differentiator, limiter, line_limits, stream)
FAR_OUT = Payload(mass=2.0, com=(0.2, -0.1, 0.15))


@pytest.fixture
def in_python(monkeypatch):
    """Calls a function with all kernels replaced by their Python source."""

    def call(function):
        with monkeypatch.context() as patched:
            for module in MODULES:
                for name, one in vars(module).copy().items():
                    if hasattr(one, "py_func"):
                        patched.setattr(module, name, one.py_func)
            return function()

    return call


@pytest.mark.parametrize("period", [H, 0.003, 0.008])
@pytest.mark.parametrize("share", [0.9, 1.0, 1.6])
def test_a_stream_is_played_alike_in_python_to_the_bit(period, share, in_python):
    """Within its limits, at them and beyond."""
    from tvist_controller.trajectory import MotionLimits, SetpointStream

    wanted = there_and_back(
        MotionLimits(share * PAPER.velocity, share * PAPER.acceleration, share * PAPER.jerk)
    )
    arrivals = network(wanted, period, 1.2, seed=3, jitter=1.2, loss=0.02)
    room = TorqueRoom(UR5E, InverseDynamics(UR5E, UR5E.payload))

    def play():
        stream = SetpointStream(np.zeros(6), period, PAPER, H, reach=np.full(6, 6.28), torque=room)
        return played(stream, arrivals, 600), stream.limited

    (compiled, limited), (plain, limited_plain) = play(), in_python(play)
    assert (compiled == plain).all()
    assert limited == limited_plain


@pytest.mark.parametrize("arm", ["ur5e", "one-joint"])
def test_the_room_of_the_torque_is_that_of_numpy_to_the_bit(arm, in_python):
    description = load(arm)
    dynamics, random = InverseDynamics(description, description.payload), np.random.default_rng(2)
    most, n = 0.9 * np.array(description.limits.torque), description.joints
    for room, beyond in (
        (TorqueRoom(description, dynamics), 0.0),
        (TorqueRoom(description, dynamics, 1.0), 1.0),
    ):
        for q, qd, qdd in random.uniform(-3, 3, (300, 3, n)):
            still = dynamics.effort(q, qd, np.zeros(n))
            inertia = np.abs(dynamics.inertia(q)).sum(axis=1)
            wanted = ((most - still) / inertia).min()
            if beyond:
                left = np.array(description.limits.torque) - still
                wanted = min(wanted, (left / ((1.0 + beyond) * inertia)).min())
            found = room.acceleration(q, qd)
            assert found == max(wanted, 1.0)
            assert found == in_python(lambda room=room, q=q, qd=qd: room.acceleration(q, qd))
            pushed = qdd * found
            fits = bool((dynamics.effort(q, qd, pushed) <= most).all())
            if beyond:
                fits &= bool(
                    (dynamics.effort(q, qd, 2.0 * pushed) <= np.array(description.limits.torque)).all()
                )
            assert room.allows(q, qd, pushed) == (fits or np.abs(pushed).max() <= 1.0)


def test_a_payload_that_is_phased_in_may_be_either():
    dynamics = InverseDynamics(UR5E, Payload())
    room = TorqueRoom(UR5E, dynamics)
    q, still = np.array(UR5E.poses["Q1"]), np.zeros(6)
    empty = room.acceleration(q, still)
    dynamics.declare(UR5E.payload)
    dynamics.advance()
    assert room.acceleration(q, still) < 0.5 * empty
    assert not room.allows(q, still, np.full(6, 0.9 * empty))


@pytest.mark.parametrize("limit", [1.0, 8.0, 40.0])
def test_the_stop_in_closed_form_is_ruckigs(limit, in_python):
    random = np.random.default_rng(int(limit))
    for scale in (1e-3, 1.0):
        qd, qdd = scale * random.uniform(-3, 3, 40), scale * random.uniform(-60, 60, 40)
        qd[:4], qdd[4:8] = 0.0, 0.0
        stop = JointStop(np.zeros(40), qd, qdd, acceleration=limit, jerk=2000.0, period=H)
        durations = []
        for j, (v, a) in enumerate(zip(qd.tolist(), qdd.tolist(), strict=True)):
            phases = clearance.stop_phases(v, a, limit, 2000.0)
            assert phases == in_python(lambda v=v, a=a: clearance.stop_phases(v, a, limit, 2000.0))
            durations.append(phases[0] + phases[2] + phases[3])
            for share in (0.0, 0.01, 0.1, 0.4, 0.8, 1.0):
                wanted = [values[j] for values in stop.at(share * stop.duration)]
                found = clearance.after(v, a, phases, share * stop.duration)
                assert found == pytest.approx(wanted, abs=1e-9)
        assert max(durations) == pytest.approx(stop.duration, abs=1e-9)


@pytest.mark.parametrize("payload", [UR5E.payload, FAR_OUT, Payload()], ids=["disc", "far out", "none"])
def test_gaps_are_coals_and_shrink_no_faster_than_the_bound(payload, in_python):
    model, random = CollisionModel(UR5E, UR5E.payload), np.random.default_rng(1)
    model.declare(payload)
    links, bodies, pairs, ends = model._parts

    def gaps(q):
        found = np.empty(len(pairs))
        least = clearance.rooms(links, bodies, pairs, ends, q, np.zeros(6), found)
        assert least == found.min()
        return found

    for _ in range(200):
        q, turned = random.uniform(-3, 3, (2, 6)) * np.array([[1.0], [0.05]])
        there, here = gaps(q + turned), gaps(q)
        theirs = np.array([by_coal(bodies, ends, int(one), int(other)) for one, other in pairs[:, :2]])
        np.testing.assert_allclose(here, in_python(lambda q=q: gaps(q)), rtol=0, atol=1e-14)
        apart = theirs > 1e-3
        np.testing.assert_allclose(here[apart], theirs[apart], rtol=0, atol=2e-6)
        assert ((here < 2e-3) == (theirs < 2e-3))[np.abs(theirs - 2e-3) > 1e-5].all()
        both = (here > 0.0) & (there > 0.0)
        assert (np.abs(there - here) <= pairs[:, 2:] @ np.abs(turned) + 1e-9)[both].all()


def by_coal(bodies, ends, one, other):
    """The distance of two bodies, of which the second may be the floor, as coal computes it."""

    def placed(number):
        if bodies[number, clearance.LINK] == clearance.FLOOR:
            return coal.Halfspace(
                np.array([0.0, 0.0, 1.0]), bodies[number, clearance.RADIUS]
            ), coal.Transform3s()
        first, second = ends[number, :3], ends[number, 3:]
        length, up = float(np.linalg.norm(second - first)), np.array([0.0, 0.0, 1.0])
        turn = pin.Quaternion.FromTwoVectors(up, second - first).matrix() if length > 0.0 else np.eye(3)
        capsule = coal.Capsule(float(bodies[number, clearance.RADIUS]), max(length, 1e-6))
        return capsule, coal.Transform3s(turn, (first + second) / 2.0)

    return coal.distance(*placed(one), *placed(other), coal.DistanceRequest(), coal.DistanceResult())


@pytest.mark.parametrize(
    "arm", [UR5E, load("one-joint"), chain(7)], ids=["ur5e", "one-joint", "seven joints"]
)
def test_a_stop_that_is_proved_clear_is_found_clear(arm, in_python):
    random = np.random.default_rng(7)
    model, joints = CollisionModel(arm, arm.payload), arm.joints
    proved = clear = 0
    for _ in range(150):
        q, qd, qdd = (
            random.uniform(-2, 2, joints),
            random.uniform(-2, 2, joints),
            random.uniform(-9, 9, joints),
        )
        state, limit = Target(q, qd, qdd), float(random.choice([2.0, 9.0, 40.0]))
        spacious = model.stop_is_spacious(state, limit, 2000.0)
        stop = JointStop(q, qd, qdd, acceleration=limit, jerk=2000.0, period=H)
        free = all(model.meeting(stop.at(time)[0]) is None for time in np.linspace(0.0, stop.duration, 60))
        assert spacious <= free
        assert spacious == in_python(
            lambda state=state, limit=limit: model.stop_is_spacious(state, limit, 2000.0)
        )
        turned = np.abs(qd) * stop.duration + 0.01
        if model.is_spacious(q, turned):
            corners = q + random.uniform(-1, 1, (20, joints)) * turned
            assert model.nearest(corners) >= CLEARANCE
        proved, clear = proved + spacious, clear + free
    assert proved >= 0.8 * clear > 0


def test_nothing_is_proved_in_a_posture_that_is_not_finite():
    model, still = CollisionModel(UR5E, UR5E.payload), np.zeros(6)
    nowhere = np.full(6, np.nan)
    assert not model.is_spacious(nowhere, still)
    assert not model.stop_is_spacious(Target(nowhere, still, still), 5.0, 2000.0)
    assert not model.stop_is_spacious(Target(still, nowhere, still), 5.0, 2000.0)


def test_the_derivatives_at_the_newest_reference_are_numpys_to_the_bit(in_python):
    references = swinging([1.0, -0.5])(np.arange(300) * H)
    for before, middle, last in zip(references, references[1:], references[2:], strict=False):
        rates = np.empty((2, 2))
        differentiator.extrapolate(before, middle, last, H, rates)
        rise, fall = last - middle, middle - before
        qdd = (rise - fall) / (H * H)
        assert (rates == (rise / H + 0.5 * H * qdd, qdd)).all()
        plain = np.empty((2, 2))
        differentiator.extrapolate.py_func(before, middle, last, H, plain)
        assert (rates == plain).all()
