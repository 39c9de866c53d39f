"""Where the arm is drawn: against the simulated arm's own truth, and against pinocchio."""

import asyncio

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tvist_controller.about import geometry_of
from tvist_lab.collect import collect
from tvist_lab.in_process import free_setup, robot_in_process
from tvist_plant.description import load
from tvist_plant.model import flexible_model
from tvist_protocol.geometry import Capsule, Geometry
from tvist_view.chain import Chain, GeometryError
from tvist_view.deflection import Magnification
from tvist_view.drawn_arm import capsule, quaternion

UR5E = load("ur5e")
angles = st.floats(-3.0, 3.0)


@pytest.fixture(scope="module")
def chain():
    return Chain(geometry_of(UR5E))


@pytest.fixture(scope="module")
def truths():
    """A motion of the flexible arm: states, truths."""

    async def move():
        async with robot_in_process(free_setup(shaper="none")) as robot:
            with collect(robot) as collected:
                async with robot.control("test") as arm:
                    await arm.move_j([0.7, -2.5, 0.5, -1.2, 0.3, 0.2])
                    await robot.advance(1000)
            return collected.states, collected.truths

    return asyncio.run(move())


@given(st.lists(angles, min_size=6, max_size=6), st.lists(st.floats(-0.5, 0.5), min_size=4, max_size=4))
def test_the_flange_is_where_the_flexible_model_has_it(q, bends):
    flexible = flexible_model(UR5E, UR5E.payload)
    everything = np.zeros(flexible.model.nv)
    everything[flexible.joints], everything[flexible.flexes] = q, bends
    data = flexible.model.createData()
    pin.framesForwardKinematics(flexible.model, data, everything)
    flange = Chain(geometry_of(UR5E)).flange(q, bends)
    np.testing.assert_allclose(flange, data.oMf[flexible.flange].homogeneous, atol=1e-12)


def test_at_factor_one_the_drawn_flange_is_the_truths(truths, chain):
    for truth in truths[1][::50]:
        for gravity in (False, True):
            flange = chain.flange(*Magnification(1.0, gravity).drawn(truth))
            np.testing.assert_allclose(flange[:3, 3], truth.flange_pose[:3], atol=1e-9)
            turned = pin.exp3(np.array(truth.flange_pose[3:]))
            np.testing.assert_allclose(flange[:3, :3], turned, atol=1e-9)


@pytest.mark.parametrize("factor", [1.0, 7.5, 100.0, 300.0])
def test_drawn_deflections_are_the_factor_times_the_truth(truths, factor):
    for truth in truths[1][::50]:
        q, bends = Magnification(factor, gravity=True).drawn(truth)
        np.testing.assert_allclose(q - truth.motor_q, factor * np.array(truth.gear_deflection), atol=1e-12)
        np.testing.assert_allclose(bends, factor * np.array(truth.link_deflection), atol=1e-12)
        q, bends = Magnification(factor).drawn(truth)
        static = np.array(truth.static_gear_deflection)
        expected = static + factor * (np.array(truth.gear_deflection) - static)
        np.testing.assert_allclose(q - truth.motor_q, expected, atol=1e-12)


def test_an_arm_at_rest_is_drawn_where_it_is_however_much_is_magnified(truths):
    """Before it moves, the arm stands in equilibrium, but for what friction holds: 1e-6 rad."""
    truth = truths[1][0]
    assert np.abs(truth.gear_deflection).max() > 1e-4
    np.testing.assert_allclose(truth.gear_deflection, truth.static_gear_deflection, atol=2e-6)
    np.testing.assert_allclose(truth.link_deflection, truth.static_link_deflection, atol=2e-6)


def test_after_a_stop_the_static_part_is_what_the_deflection_settles_to(truths):
    """Friction holds a gear a little off its equilibrium; what vibrates in the motion is far larger."""
    everything = np.array([truth.gear_deflection for truth in truths[1]])
    static = np.array([truth.static_gear_deflection for truth in truths[1]])
    moving = np.abs(everything - static).max(axis=0)
    assert moving.max() > 1e-3
    assert np.abs(everything[-1] - static[-1]).max() < 0.5 * moving.max()


def test_a_truth_of_an_older_server_is_drawn_with_gravity(truths):
    from msgspec.structs import replace

    old = replace(truths[1][100], static_gear_deflection=[], static_link_deflection=[])
    np.testing.assert_array_equal(
        Magnification(10.0).drawn(old)[0], Magnification(10.0, gravity=True).drawn(old)[0]
    )


def test_a_capsule_of_a_bending_link_is_cut_in_its_middle(chain):
    near, far = (part for part in chain.parts if part.name.startswith("upper_arm"))
    np.testing.assert_allclose(near.end, far.start)
    frames = chain.frames(np.zeros(6))
    ends = [frames[part.frame] @ [*part.end, 1.0] for part in (near, far)]
    np.testing.assert_allclose(np.linalg.norm(near.end - near.start), 0.2125, atol=1e-12)
    np.testing.assert_allclose(ends[0] - ends[1], [0.2125, 0.0, 0.0, 0.0], atol=1e-12)


def test_without_bending_near_and_far_frames_are_the_same(chain):
    frames = chain.frames([0.1, -1.0, 0.5, 0.3, 0.2, 0.1])
    np.testing.assert_allclose(frames[1::2], frames[2::2], atol=1e-15)


@pytest.mark.parametrize(
    ("changes", "says"),
    [
        ({"version": 2}, "version 2"),
        ({"a": [0.1]}, "different lengths"),
        ({"bending": [2]}, "does not exist"),
        ({"capsules": [Capsule(name="x", link=5, start=(0, 0, 0), end=(0, 0, 1), radius=0.1)]}, "not exist"),
    ],
)
def test_a_geometry_that_cannot_be_drawn_is_said(changes, says):
    with pytest.raises(GeometryError, match=says):
        Chain(Geometry(**{"a": [0.1, 0.2], "d": [0.0, 0.0], "alpha": [0.0, 0.0], **changes}))


def test_deflections_of_another_arm_are_refused(chain):
    with pytest.raises(GeometryError, match="3 link deflections for 2 bending links"):
        chain.frames(np.zeros(6), np.zeros(3))


@pytest.mark.parametrize("end", [(0.0, 0.0, 0.4), (0.3, 0.0, 0.0), (-0.2, 0.1, 0.05), (0.1, 0.2, -0.3)])
def test_a_capsule_reaches_from_end_to_end_and_as_far_around(end):
    start, end = np.array([0.1, -0.2, 0.3]), np.array([0.1, -0.2, 0.3]) + end
    mesh = capsule(start, end, 0.05)
    axis = end - start
    along = np.clip((mesh.vertices - start) @ axis / (axis @ axis), 0.0, 1.0)
    distances = np.linalg.norm(mesh.vertices - (start + along[:, None] * axis), axis=1)
    np.testing.assert_allclose(distances, 0.05, atol=1e-6)
    assert along.min() == 0.0
    assert along.max() == 1.0


@given(st.lists(st.floats(-3.2, 3.2), min_size=3, max_size=3))
def test_quaternions_turn_as_their_matrices_do(vector):
    rotation = pin.exp3(np.array(vector))
    w, x, y, z = quaternion(rotation)
    np.testing.assert_allclose(pin.Quaternion(w, x, y, z).matrix(), rotation, atol=1e-9)
    assert w * w + x * x + y * y + z * z == pytest.approx(1.0)
