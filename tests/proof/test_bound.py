"""The least time without vibration: against a solver of its own, and against simulated modes."""

import numpy as np
import pytest
from msgspec.structs import replace
from proof.bound import with_lead
from proof.bound.least_time import bound, farthest, least_ticks, poles_of
from scipy import sparse
from scipy.optimize import linprog
from scipy.signal import cont2discrete
from tests.controller.robots import spring_loads

from tvist_controller.api.line import MotionLimits, body, paper_payload
from tvist_controller.line.differentiator import Target
from tvist_controller.line.elastic_lead import wanted_lead
from tvist_controller.line.elastic_model import ElasticModel
from tvist_controller.line.inverse_dynamics import InverseDynamics
from tvist_lab.study.line import PAPER
from tvist_lab.study.moves import Move
from tvist_plant.description import load
from tvist_plant.model import flexible_model
from tvist_plant.plant import PERIOD as H

NONE = np.zeros((0, 2))
F_D, ZETA = np.array([9.0, 15.0]), np.array([0.2, 0.1])


def longest_way(ticks, limits, f_d, zeta):
    """The same linear programme, with all states as unknowns and the modes discretised as oscillators."""
    blocks = []
    for f, z in zip(f_d, zeta, strict=True):
        omega = 2.0 * np.pi * f / np.sqrt(1.0 - z * z)
        blocks.append([[0.0, 1.0], [-(omega**2), -2.0 * z * omega]])
    size = 3 + 2 * len(blocks)
    A, B = np.zeros((size, size)), np.zeros((size, 1))
    A[0, 1] = A[1, 2] = B[2, 0] = 1.0
    for number, block in enumerate(blocks):
        at = 3 + 2 * number
        A[at : at + 2, at : at + 2], A[at + 1, 2] = block, -1.0
    scale = np.array([1.0, 1.0, 1.0, *[s for f in f_d for s in (1e-4, 1e-2)]])
    move, push = cont2discrete((A, B, np.eye(size), np.zeros((size, 1))), H)[:2]
    move, push = move * scale / scale[:, None], push / scale[:, None]
    states = size * (ticks + 1)
    steps = sparse.kron(sparse.eye(ticks, ticks + 1, k=1), sparse.eye(size)) - sparse.kron(
        sparse.eye(ticks, ticks + 1), move
    )
    equations = sparse.hstack((steps, sparse.kron(sparse.eye(ticks), -push)), format="csr")
    most = [(None, None), (-limits.velocity, limits.velocity), (-limits.acceleration, limits.acceleration)]
    free = [(None, None)] * (2 * len(blocks))
    rest = [(0.0, 0.0)] * (size - 1)
    bounds = [(0.0, 0.0), *rest] + (most + free) * (ticks - 1) + [(None, None), *rest]
    bounds += [(-limits.jerk, limits.jerk)] * ticks
    cost = np.zeros(states + ticks)
    cost[size * ticks] = -1.0
    found = linprog(cost, A_eq=equations, b_eq=np.zeros(size * ticks), bounds=bounds, method="highs")
    assert found.status == 0
    return -found.fun


@pytest.mark.parametrize("limits", [PAPER, MotionLimits(0.3, 2.0, 100.0)])
@pytest.mark.parametrize("modes", [0, 1, 2])
def test_the_longest_way_is_that_of_another_solver_with_oscillators(limits, modes):
    ticks = 160
    f_d, zeta = F_D[:modes], ZETA[:modes]
    theirs = longest_way(ticks, limits, f_d, zeta)
    ours = farthest(ticks, limits, poles_of(f_d, zeta) if modes else NONE)
    assert ours == pytest.approx(theirs, rel=2e-4)


def test_without_modes_it_takes_as_long_as_a_double_s():
    velocity, acceleration, jerk = PAPER.velocity, PAPER.acceleration, PAPER.jerk
    way = 1.5
    duration = way / velocity + velocity / acceleration + acceleration / jerk
    assert least_ticks(way, PAPER, NONE, 10) == pytest.approx(duration / H, abs=1.0)


def test_a_mode_costs_time_and_a_second_one_more():
    start, target = np.zeros(2), np.array([0.8, -0.3])
    one = bound(start, target, PAPER, F_D[:1], ZETA[:1])
    two = bound(start, target, PAPER, F_D, ZETA)
    assert 0.0 < one < 0.5 / F_D[0]  # sooner than a zero-vibration shaper
    assert one <= two < 0.5 / F_D[0] + 0.5 / F_D[1]


ARM = load("ur5e").disturbed_by(())
MOVE = Move(tuple(ARM.poses["Q1"]), tuple(ARM.poses["Q3"]), 5.0)


def weaker(share):
    return replace(ARM, limits=replace(ARM.limits, torque=tuple(share * t for t in ARM.limits.torque)))


def test_with_a_lead_the_torque_alone_costs_time():
    strong, own, weak = (
        with_lead.bound_with_lead(arm, MOVE, PAPER) for arm in (weaker(100.0), ARM, weaker(0.1))
    )
    assert 0.0 == strong <= own <= 2.01 * H < weak


def test_the_lead_of_the_bound_is_that_of_the_controller():
    payload = body(paper_payload(ARM, MOVE.mass))
    flexible = flexible_model(ARM, payload)
    stiffness = np.zeros(flexible.model.nv)
    stiffness[flexible.joints], stiffness[flexible.flexes] = (
        ARM.drives.gear_stiffness,
        flexible.flex_stiffness,
    )
    model = ElasticModel(ARM, stiffness, np.zeros_like(stiffness))
    loads = model.loads()
    loads.carry(InverseDynamics(ARM, payload).payload_parameters)
    q, along = np.array(MOVE.start) + 0.3, np.array([1.0, -0.4, 0.7, 0.1, 0.0, 0.2])
    load_on, jacobian = spring_loads(loads, model.joints, Target(q, np.zeros(6), along))
    lead = np.empty(6)
    wanted_lead(
        load_on, jacobian, model.joints, model.flexes, stiffness, np.zeros_like(stiffness),
        np.zeros_like(stiffness), lead,
    )  # fmt: skip
    data, springs = flexible.model.createData(), np.array(ARM.drives.gear_stiffness)
    assert with_lead._lead(flexible, data, springs, q, along) == pytest.approx(lead, rel=1e-9, abs=1e-15)
