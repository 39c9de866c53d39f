"""What streams and their look-ahead compute at every tick, compiled, against its own Python source and others."""

import numpy as np
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
from tvist_plant.description import load

from .robots import PAPER, UR5E, H
from .streams import network, played, there_and_back

MODULES = (clearance, differentiator, limiter, line_limits, stream)


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


@pytest.mark.parametrize(("period", "share"), [(H, 1.0), (0.003, 0.9), (0.008, 1.6)])
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


@pytest.mark.parametrize(("arm", "beyond"), [("ur5e", 0.0), ("ur5e", 1.0), ("one-joint", 0.0)])
def test_the_room_of_the_torque_is_that_of_numpy_to_the_bit(arm, beyond):
    description = load(arm)
    dynamics, random = InverseDynamics(description, description.payload), np.random.default_rng(2)
    limit, n = np.array(description.limits.torque), description.joints
    room = TorqueRoom(description, dynamics, beyond)
    for q, qd, qdd in random.uniform(-3, 3, (300, 3, n)):
        still = dynamics.effort(q, qd, np.zeros(n))
        inertia = np.abs(dynamics.inertia(q)).sum(axis=1)
        wanted = ((0.9 * limit - still) / inertia).min()
        if beyond:
            wanted = min(wanted, ((limit - still) / ((1.0 + beyond) * inertia)).min())
        found = room.acceleration(q, qd)
        assert found == max(wanted, 1.0)
        pushed = qdd * found
        fits = (dynamics.effort(q, qd, pushed) <= 0.9 * limit).all()
        if beyond:
            fits &= (dynamics.effort(q, qd, 2.0 * pushed) <= limit).all()
        assert room.allows(q, qd, pushed) == (fits or np.abs(pushed).max() <= 1.0)


@pytest.mark.parametrize("limit", [1.0, 8.0, 40.0])
def test_the_stop_in_closed_form_is_ruckigs(limit):
    random = np.random.default_rng(int(limit))
    for scale in (1e-3, 1.0):
        qd, qdd = scale * random.uniform(-3, 3, 40), scale * random.uniform(-60, 60, 40)
        qd[:4], qdd[4:8] = 0.0, 0.0
        stop = JointStop(np.zeros(40), qd, qdd, acceleration=limit, jerk=2000.0, period=H)
        durations = []
        for j, (v, a) in enumerate(zip(qd.tolist(), qdd.tolist(), strict=True)):
            phases = clearance.stop_phases(v, a, limit, 2000.0)
            durations.append(phases[0] + phases[2] + phases[3])
            for share in (0.0, 0.01, 0.1, 0.4, 0.8, 1.0):
                wanted = [values[j] for values in stop.at(share * stop.duration)]
                found = clearance.after(v, a, phases, share * stop.duration)
                assert found == pytest.approx(wanted, abs=1e-9)
        assert max(durations) == pytest.approx(stop.duration, abs=1e-9)


@pytest.mark.parametrize(
    "arm", [UR5E, load("one-joint"), chain(7)], ids=["ur5e", "one-joint", "seven joints"]
)
def test_a_stop_that_is_proved_clear_is_found_clear(arm):
    random = np.random.default_rng(7)
    model, joints = CollisionModel(arm, arm.payload), arm.joints
    proved = clear = 0
    for _ in range(150):
        q, qd, qdd = random.uniform(-1, 1, (3, joints)) * [[2.0], [2.0], [9.0]]
        state, limit = Target(q, qd, qdd), float(random.choice([2.0, 9.0, 40.0]))
        spacious = model.stop_is_spacious(state, limit, 2000.0)
        stop = JointStop(q, qd, qdd, acceleration=limit, jerk=2000.0, period=H)
        free = all(model.meeting(stop.at(time)[0]) is None for time in np.linspace(0.0, stop.duration, 60))
        assert spacious <= free
        turned = np.abs(qd) * stop.duration + 0.01
        if model.is_spacious(q, turned):
            corners = q + random.uniform(-1, 1, (20, joints)) * turned
            assert model.nearest(corners) >= CLEARANCE
        proved, clear = proved + spacious, clear + free
    assert proved >= 0.8 * clear > 0
