"""Computed values of UR's interfaces agree with the values that they are computed from."""

import math

import msgspec
import numpy as np
import pinocchio as pin
import pytest
from tests.controller.robots import UR5E, cut
from tests.plant.arms import chain

from tvist_controller.instruments.snapshot import Instruments
from tvist_controller.kinematics.arm import InverseDynamics
from tvist_controller.setup import body, paper_payload
from tvist_plant.model import rigid_model
from tvist_protocol import commands as c
from tvist_protocol.values import Payload

from .rtde_client import OUTPUT_TYPES

FOLLOWED = ("target_q", "target_qd", "target_qdd")
UNSHAPED = dict.fromkeys(("unshaped_q", "unshaped_qd", "unshaped_qdd"))
MOVED = (1.5, -0.8, 1.0, -1.0, 0.5, 1.0)
ELBOW_UP = (0.3, -1.3, 1.6, -1.9, -1.4, 0.2)  # a posture far from singular ones
FAR = (0.8, -1.1, 1.3, -1.8, -1.3, 0.2)  # another one
NOTHING, KILOGRAM = (Payload(mass=mass, com=(0.0, 0.0, 0.0), inertia=(0.0,) * 6) for mass in (0.0, 1.0))
OFFSET = [0.03, -0.05, 0.15, 0.2, -0.4, 0.7]
PERIOD = 0.002


@pytest.mark.parametrize("joints", [1, 4, 6, 7])
def test_every_output_variable_is_finite_for_any_number_of_joints(ur5e, joints):
    seven = msgspec.structs.replace(chain(7), poses={"Q1": (0.4,) * 7})
    robot = ur5e(seven if joints == 7 else UR5E if joints == 6 else cut(joints))
    robot.send(c.MoveJ, q=tuple(0.9 * angle for angle in robot.controller.setup.q))
    snapshot = robot.tick(40)
    for name, kind in OUTPUT_TYPES.items():
        value = getattr(snapshot, name)
        numbers = value if isinstance(value, list) else [value]
        assert all(map(math.isfinite, numbers)), name
        lengths = {"VECTOR3": {joints, 3}, "VECTOR6": {joints, 6}}.get(kind[:7], {1})
        assert len(numbers) in lengths, name


def test_slider_times_scaling_is_the_speed(ur5e):
    """Drivers multiply the two, and hold their trajectories while the product is 0."""
    robot = ur5e(io_changes={"target_speed_fraction": 0.5})
    robot.send(c.SetSpeed, fraction=0.5)
    robot.send(c.MoveJ, q=UR5E.poses["Q2"])
    snapshot = robot.tick(100)
    assert snapshot.state.speed_scaling == pytest.approx(0.5)
    assert snapshot.speed_scaling == pytest.approx(1.0)
    assert ur5e(io_changes={"program_state": "PAUSED"}).tick().speed_scaling == 0.0


def test_registers_are_taken_from_io(ur5e):
    changes = {
        "input_int_register": list(range(48)),
        "output_double_register": [k / 7 for k in range(48)],
        "input_bit_register": [5, 1 << 31, 1 << 2, 1],
    }
    snapshot = ur5e(io_changes=changes).tick()
    assert snapshot.input_int_register_47 == 47
    assert snapshot.output_double_register_12 == 12 / 7
    assert (snapshot.input_bit_registers0_to_31, snapshot.input_bit_registers32_to_63) == (5, 1 << 31)
    assert [k for k in range(64, 128) if getattr(snapshot, f"input_bit_register_{k}")] == [66, 96]


def shaped(ur5e, io_changes=None):
    """Return a snapshot in a shaped move, far from the unshaped target."""
    robot = ur5e(q=ELBOW_UP, shaper="zv", io_changes=io_changes)
    robot.send(c.MoveJ, q=FAR)
    snapshot = robot.tick(150)
    assert np.abs(np.subtract(snapshot.target_q, snapshot.shaped_q)).max() > 1e-3
    return snapshot


def test_ur_targets_are_unshaped_and_shaped_values_have_separate_names(ur5e):
    snapshot = shaped(ur5e)
    for name in FOLLOWED:
        assert getattr(snapshot, name.replace("target", "shaped")) == getattr(snapshot.state, name)
        assert getattr(snapshot, name) == getattr(snapshot.state, name.replace("target", "unshaped"))


def test_values_of_the_target_are_computed_from_the_unshaped_one(ur5e):
    snapshot = shaped(ur5e, {"tcp_offset": OFFSET})
    of_the_program = {name: getattr(snapshot.state, name.replace("target", "unshaped")) for name in FOLLOWED}
    state = msgspec.structs.replace(snapshot.state, **of_the_program, **UNSHAPED)
    other = Instruments(UR5E).snapshot(state, snapshot.io)
    for name in ("target_TCP_pose", "target_TCP_speed", "target_TCP_acceleration", "target_base_wrench"):
        assert getattr(snapshot, name) == getattr(other, name), name


def test_the_target_moment_is_that_of_the_rigid_arm(ur5e):
    snapshot = shaped(ur5e)
    dynamics = InverseDynamics(UR5E, body(paper_payload(UR5E)))
    expected = dynamics.torque(*(np.array(getattr(snapshot, name)) for name in FOLLOWED))
    assert snapshot.target_moment == pytest.approx(expected, abs=1e-9)
    assert np.abs(np.subtract(snapshot.target_moment, snapshot.state.target_moment)).max() > 0.1


def test_measured_values_are_compared_with_the_shaped_target(ur5e):
    snapshot = shaped(ur5e)
    other = Instruments(UR5E).snapshot(msgspec.structs.replace(snapshot.state, **UNSHAPED), snapshot.io)
    for name in (
        "actual_TCP_force", "actual_TCP_acceleration", "ft_raw_wrench", "collision_detection_ratio",
        "joint_position_deviation_ratio", "actual_current",
    ):  # fmt: skip
        assert getattr(snapshot, name) == getattr(other, name), name


def test_currents_are_proportional_to_moments(snapshots):
    some = snapshots[::11]
    targets = np.array([one.target_moment for one in some]) / np.array([one.target_current for one in some])
    moments = np.array([one.state.actual_moment for one in some])
    actuals = moments / np.array([one.actual_current for one in some])
    for ratios in (targets, actuals):
        np.testing.assert_allclose(ratios[:, 1:3], np.tile(targets[0, 1:3], (len(some), 1)), rtol=1e-9)


def test_currents_under_gravity_are_those_of_ursim(ur5e):
    """At the start posture of UR's simulator, without payload: 2.14, 1.49 and 0.23 A."""
    start = (-1.6007, -1.7271, -2.203, -0.808, 1.5951, -0.031)
    current = ur5e(q=start, payload=NOTHING).tick().target_current
    assert np.abs(current[1:4]) == pytest.approx([2.14, 1.49, 0.23], rel=0.02)


def test_brakes_hold_the_arm_without_current(ur5e):
    for mode, voltage in (("IDLE", 48.0), ("POWER_OFF", 0.0)):
        snapshot = ur5e(mode=mode).tick(3)
        assert snapshot.actual_current == snapshot.target_current == [0.0] * 6
        assert snapshot.actual_TCP_force == [0.0] * 6
        assert snapshot.actual_joint_voltage == [voltage] * 6
        assert snapshot.actual_robot_voltage == voltage
        assert snapshot.joint_mode == [255 if mode == "IDLE" else 239] * 6
        assert snapshot.robot_status_bits == (mode == "IDLE")


def test_energy_is_the_integral_of_power(snapshots):
    steps = np.diff([snapshot.actual_robot_energy_consumed for snapshot in snapshots])
    power = [48.0 * snapshot.actual_robot_current for snapshot in snapshots]
    assert steps == pytest.approx(np.array(power[1:]) * PERIOD)


def held(ur5e, seconds, step=5.0):
    """Yield temperatures of a robot that holds its payload, every `step` seconds."""
    robot = ur5e()
    state = robot.tick().state
    for time in np.arange(step, seconds + step, step):
        later = msgspec.structs.replace(state, tick=round(time / PERIOD))
        yield robot.instruments.snapshot(later, robot.io).joint_temperatures


def test_temperatures_rise_monotonically_to_their_final_value(ur5e):
    curve = np.array(list(held(ur5e, 10 * 1200.0)))
    assert np.diff(curve, axis=0).min() >= 0.0
    assert np.abs(curve[-1] - curve[-2]).max() < 0.01
    base, shoulder, elbow = curve[-1][:3]
    assert 80.0 > shoulder > elbow > base > 25.0


def test_momentum_is_that_of_the_centre_of_mass(ur5e):
    robot = ur5e(q=ELBOW_UP)
    robot.send(c.MoveJ, q=MOVED)
    model = rigid_model(UR5E, body(paper_payload(UR5E)))
    data = model.createData()
    mass = sum(inertia.mass for inertia in model.inertias)
    for _ in range(3):
        snapshot = robot.tick(60)
        q, step = np.array(snapshot.actual_q), 1e-6 * np.array(snapshot.actual_qd)
        before, after = (pin.centerOfMass(model, data, at).copy() for at in (q - step, q + step))
        expected = mass * np.linalg.norm(after - before) / 2e-6
        assert snapshot.actual_momentum == pytest.approx(expected, rel=1e-6)
        assert snapshot.actual_momentum > 0.1


def test_target_speed_and_acceleration_are_differences_of_the_pose(ur5e):
    robot = ur5e(q=ELBOW_UP, shaper="none", io_changes={"tcp_offset": OFFSET})
    robot.send(c.MoveJ, q=MOVED)
    for ticks in (100, 40):
        before, middle, after = (robot.tick(count) for count in (ticks, 1, 1))
        poses = np.array([before.target_TCP_pose, after.target_TCP_pose])
        turned = pin.log3(pin.exp3(poses[1, 3:]) @ pin.exp3(poses[0, 3:]).T)
        speed = np.array([*(poses[1] - poses[0])[:3], *turned]) / (2 * PERIOD)
        assert speed == pytest.approx(middle.target_TCP_speed, abs=1e-4)
        faster = np.subtract(after.target_TCP_speed, before.target_TCP_speed) / (2 * PERIOD)
        assert faster == pytest.approx(middle.target_TCP_acceleration, abs=2e-2)


def test_the_tcp_is_the_flange_moved_by_its_offset(ur5e):
    bare = ur5e(q=ELBOW_UP).tick()
    tool = ur5e(q=ELBOW_UP, io_changes={"tcp_offset": OFFSET}).tick()
    assert bare.target_TCP_pose == pytest.approx(bare.actual_TCP_pose, abs=1e-2)
    flange, tcp, offset = (
        pin.SE3(pin.exp3(np.array(pose[3:])), np.array(pose[:3]))
        for pose in (bare.target_TCP_pose, tool.target_TCP_pose, OFFSET)
    )
    assert (flange * offset).isApprox(tcp, 1e-12)


def test_the_elbow_is_where_the_upper_arm_ends(ur5e):
    robot = ur5e(q=ELBOW_UP)
    position = np.array(robot.tick().elbow_position)
    shoulder = np.array([0.0, 0.0, UR5E.kinematics.d[0]])
    assert np.linalg.norm(position - shoulder) == pytest.approx(-UR5E.kinematics.a[1])
    robot.send(c.MoveJ, q=MOVED)
    before, middle, after = (robot.tick(n) for n in (200, 1, 1))
    moved = np.array(after.elbow_position) - np.array(before.elbow_position)
    assert moved / (2 * PERIOD) == pytest.approx(middle.elbow_velocity, abs=1e-3)
    assert np.linalg.norm(middle.elbow_velocity) > 0.05


def test_the_base_wrench_at_rest_is_the_weight(ur5e):
    x, y, z, *_ = ur5e(q=ELBOW_UP).tick().target_base_wrench
    weight = 9.81 * (sum(UR5E.links.mass) + UR5E.payload.mass)
    assert (x, y, z) == pytest.approx((0.0, 0.0, -weight), abs=1e-9)


@pytest.mark.parametrize("offset", [[0.0] * 6, OFFSET])
def test_the_force_is_the_weight_of_an_undeclared_mass(ur5e, offset):
    robot = ur5e(q=ELBOW_UP, payload=NOTHING, carried=KILOGRAM, io_changes={"tcp_offset": offset})
    snapshot = robot.tick(5)
    x, y, z, *torque = snapshot.actual_TCP_force
    assert (x, y, z) == pytest.approx((0.0, 0.0, -9.81), abs=0.3)
    flange = pin.SE3(pin.exp3(np.array(snapshot.actual_TCP_pose[3:])), np.zeros(3))
    lever = -(flange.rotation @ np.array(offset[:3]))
    assert torque == pytest.approx(np.cross(lever, (0.0, 0.0, -9.81)), abs=0.1)
    assert snapshot.tcp_force_scalar == pytest.approx(9.81, abs=0.3)
    assert snapshot.wrench_calc_from_currents == snapshot.actual_TCP_force


def test_the_flange_sensor_measures_the_whole_payload(ur5e):
    for declared in (5.0, 2.0):
        payload, carried = paper_payload(UR5E, declared), paper_payload(UR5E, 5.0)
        wrench = np.array(ur5e(q=ELBOW_UP, payload=payload, carried=carried).tick(5).ft_raw_wrench)
        assert np.linalg.norm(wrench[:3]) == pytest.approx(5.0 * 9.81, rel=0.02)


def test_payload_inertia_has_the_order_of_the_interface(ur5e):
    payload = Payload(mass=2.0, com=(0.01, 0.02, 0.03), inertia=(0.02, 0.001, 0.002, 0.03, 0.003, 0.04))
    snapshot = ur5e(q=ELBOW_UP, payload=payload).tick()
    assert snapshot.payload == 2.0
    assert snapshot.payload_cog == [0.01, 0.02, 0.03]
    assert snapshot.payload_inertia == [0.02, 0.03, 0.04, 0.001, 0.002, 0.003]
