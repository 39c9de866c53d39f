"""Recordings made by hand, of which every metric's answer is known."""

from types import SimpleNamespace

import numpy as np
import pytest
from tests.lab.made_logs import damped

from tvist_controller.api.line import InverseDynamics, JointLine, body, quickest_motion
from tvist_controller.sources import calibrations
from tvist_lab.metrics import motions
from tvist_lab.recordings import STATE_COLUMNS, Recording

PERIOD = 0.002
JOINTS = 6


def straight_step(ticks, start, stop, stroke):
    """A joint that goes at constant speed: its first and last moving ticks are exact."""
    return stroke * np.clip((np.arange(ticks) - start) / (stop - start), 0.0, 1.0)


def torques_along(arm, payload, start, end, limits):
    """Return the torques of weight and of motion at each tick of the quickest motion of a rigid arm [N m]."""
    dynamics, motion = InverseDynamics(arm, body(payload)), quickest_motion(JointLine(start, end), limits)
    way = [start]
    while not motion.finished:
        way.append(motion.next())
    q = np.array(way)
    qd = np.gradient(q, PERIOD, axis=0)
    weight = dynamics.gravities(q)
    return weight, dynamics.torques(q, qd, np.gradient(qd, PERIOD, axis=0)) - weight


@pytest.fixture(scope="session")
def modal():
    return calibrations.load("ur5e_modal")


def make_recording(
    reference=None,
    target=None,
    *,
    ticks=1500,
    position=None,
    rotation=None,
    alpha=None,
    truth=None,
    events=(),
    **columns,
):
    """Build a recording from arrays; what is not given rests."""
    tick = np.arange(ticks)
    up = np.tile([0.0, 0.0, 9.81], (ticks, 1))
    zeros = np.zeros((ticks, JOINTS))
    of_joints = {
        name: np.zeros((ticks, JOINTS)) if q is None else np.column_stack([q, zeros[:, 1:]])
        for name, q in (("reference_q", reference), ("target_q", target))
    }
    made = {name: np.zeros(ticks) for name in STATE_COLUMNS}
    made |= dict.fromkeys(("target_qd", "target_qdd", "target_moment"), zeros)
    made |= dict.fromkeys(("actual_q", "actual_qd", "actual_moment", "actual_TCP_speed"), zeros)
    made |= of_joints
    made["tick"] = tick.astype(float)
    made["timestamp"] = tick * PERIOD
    made["actual_TCP_pose"] = np.zeros((ticks, 6))
    made["actual_TCP_pose"][:, :3] = 0.0 if position is None else position
    made["actual_TCP_pose"][:, 3:] = 0.0 if rotation is None else rotation
    made["actual_tool_accelerometer"] = up + (0.0 if alpha is None else alpha)
    made["estimated_f_d"] = np.full((ticks, 1), 10.0)
    made["estimated_zeta"] = np.full((ticks, 1), 0.2)
    if truth is not None:
        made["truth_tool_acceleration"] = up + truth
    return Recording({**made, **columns}, tuple(events))


def one_motion(shaped_ticks=0, **columns):
    """A motion of one joint from tick 100 to 500, published a tick later and shaped by so many ticks more."""
    ticks = columns.setdefault("ticks", 1500)
    reference = straight_step(ticks, 100, 500, 1.0)
    target = straight_step(ticks, 101, 501 + shaped_ticks, 1.0)
    return make_recording(reference, target, **columns)


def event(tick, kind, identifier=None):
    """An event as the protocol has it."""
    return SimpleNamespace(tick=tick, kind=kind, id=identifier, code=None, why=None)


def ring(ticks, start, f_d, zeta, amplitude, *, axis=(1.0, 0.0, 0.0), phase=0.0):
    """A damped sine on given axes from a tick on, zero before."""
    wave = damped(PERIOD * (np.arange(ticks) - start), f_d, zeta, phase)
    return amplitude * wave[:, None] * (np.array(axis) / np.linalg.norm(axis))


@pytest.fixture(scope="session")
def recorded():
    """The same motion without and with shaping."""
    ticks = 1500

    def make(shaped_ticks, amplitude):
        position = np.zeros((ticks, 3))
        position[:, 0] = np.interp(np.arange(ticks), [100, 540], [0.5, 0.0])
        qdd = np.zeros((ticks, 6))
        qdd[101:200, 0], qdd[101:200, 1:3] = 2.0, 1.0
        rung = ring(ticks, 501 + shaped_ticks, 10.0, 0.1, amplitude)
        recording = one_motion(shaped_ticks, alpha=rung, truth=rung, position=position, target_qdd=qdd)
        return recording, motions(recording)[0]

    return make(0, 1.0), make(37, 0.1)


@pytest.fixture(scope="session")
def figures():
    """The package, imported where it is used: matplotlib takes a second that other tests need not wait."""
    import tvist_lab.figures

    return tvist_lab.figures
