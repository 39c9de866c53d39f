"""Calibrations belong to the arm they were measured on; a robot warns if it is another one."""

import msgspec
import numpy as np
import pytest
from tests.plant.arms import changed

from tvist_controller.about import info_of
from tvist_controller.setup import body, paper_payload
from tvist_controller.sources.calibrations import available, default_for, estimator_of, load, modal_estimator
from tvist_plant.description import fingerprint, robots
from tvist_plant.description import load as load_robot
from tvist_plant.flexible_arm import FlexibleArm
from tvist_protocol import commands as c
from tvist_protocol.replies import Done
from tvist_shaping.errors import EstimatorError

from .robots import Q3, UR5E, Robot

SHIPPED = [load_robot(name) for name in robots()]
SOFT = changed(UR5E, "drives", gear_stiffness=tuple(0.5 * k for k in UR5E.drives.gear_stiffness))
RENAMED = changed(changed(UR5E, "robot", name="left"), "limits", position=(3.2,) * 6)


@pytest.mark.parametrize("name", available())
def test_shipped_calibrations_match_their_robot_file(name):
    calibration = load(name)
    (arm,) = (arm for arm in SHIPPED if arm.robot.model == calibration.robot)
    assert calibration.provenance.arm == fingerprint(arm)


@pytest.mark.parametrize(("arm", "fits"), [(RENAMED, True), (SOFT, False)], ids=["renamed", "softer"])
def test_only_a_calibration_of_another_arm_causes_a_warning_at_start(arm, fits):
    robot = Robot(arm, calibration=load("ur5e_5kg"))
    robot.tick()
    words = "'ur5e_5kg' was measured on a different arm", "tvist identify"
    assert [all(one in why for one in words) for why in robot.warnings()] == [True] * (not fits)
    assert info_of(robot.controller).calibration.fits_arm is fits


@pytest.fixture(scope="module")
def shipped():
    return load("ur5e_modal")


def test_the_shipped_modal_model_matches_the_true_modes_with_any_payload(shipped):
    """This is the shipped file; another dozen of noisy ring-downs may be worse by chance."""
    rng = np.random.default_rng(2025)
    off = []
    for _ in range(60):
        q = rng.uniform([-np.pi, -np.pi, -2.6, -np.pi, 0, 0], [np.pi, 0, 2.6, 0, 0, 0])
        payload = paper_payload(UR5E, float(rng.uniform(0.0, 5.0)))
        true = FlexibleArm(UR5E, body(payload)).modes(q)
        f_d, zeta = modal_estimator(shipped, UR5E, payload, 3).estimate(q)
        off.append((np.abs(f_d / true.f_d[:3] - 1.0), np.abs(zeta / true.zeta[:3] - 1.0)))
    f_d, zeta = np.median(off, axis=0)
    assert (f_d < 0.02).all()
    assert (zeta[:2] < 0.06).all()
    assert zeta[2] < 0.25


def test_a_calibration_without_the_needed_model_or_of_another_arm_is_refused(shipped):
    foreign = msgspec.structs.replace(shipped, robot="UR10e")
    for wrong, words in ((foreign, "'UR5e', which this arm"), (load("ur5e_5kg"), "tvist identify")):
        with pytest.raises(EstimatorError, match=words):
            modal_estimator(wrong, UR5E, paper_payload(UR5E))
    with pytest.raises(EstimatorError, match="polynomial"):
        estimator_of(shipped)


@pytest.mark.parametrize("quantity", ["gear_stiffness", "damping_time", "bending_stiffness"])
def test_a_missing_or_repeated_parameter_is_refused_by_name(shipped, quantity):
    known = shipped.modal.parameters
    one = [parameter for parameter in known if parameter.quantity == quantity]
    for parameters in (tuple(other for other in known if other not in one), (*known, one[0])):
        wrong = changed(shipped, "modal", parameters=parameters)
        with pytest.raises(EstimatorError, match=f"{quantity} of joints"):
            modal_estimator(wrong, UR5E, paper_payload(UR5E))


ONE_JOINT = load_robot("one-joint")


def test_the_default_calibration_belongs_to_the_robot_model():
    robot = Robot(ONE_JOINT, calibration=load(default_for(ONE_JOINT.robot.model)))
    assert info_of(robot.controller).calibration.fits_arm is True
    assert info_of(robot.controller).poses == ONE_JOINT.poses
    assert (default_for("UR5e"), default_for("nobody's arm")) == ("ur5e_5kg", None)


@pytest.mark.parametrize(("mass", "acceleration"), [(0.0, 10.0), (2.0, 2.0)])
def test_the_first_move_after_rest_causes_no_payload_warning(mass, acceleration):
    """While the soft spring winds up, the motor carries nothing yet."""
    for elbow in np.radians([-120.0, 0.0, 90.0]):
        robot = Robot(ONE_JOINT, q=(0.0, elbow), payload=paper_payload(ONE_JOINT, mass), shaper="none")
        robot.tick(1000)
        robot.send(c.MoveJ, q=(-0.1, elbow - 0.1), acceleration=acceleration)
        robot.until_rest()
        assert "warning" not in robot.kinds()


POLYNOMIAL = load("ur5e_5kg")
NAMES = ("auto", "auto-target", "elastic-auto")


def ringing(robot: Robot) -> float:
    """Return the largest true acceleration of the tool later than 10 ms after the reference stops [m/s²]."""
    arm = robot.controller.cycle.plant
    robot.tick(5)
    felt = []
    for _ in range(300):
        robot.tick()
        felt.append(arm.truth().specific_force)
    return np.linalg.norm(np.array(felt) - felt[-1], axis=1)[:200].max()


def test_modal_shapers_leave_less_vibration_than_zv():
    left = {}
    for shaper in ("none", "zv", *NAMES):
        robot = Robot(calibration=POLYNOMIAL)
        assert robot.send(c.SetShaper, name=shaper) == Done()
        robot.send(c.MoveJ, q=tuple(Q3))
        robot.until_rest()
        left[shaper] = ringing(robot)
        if shaper in NAMES:
            assert robot.controller.assumed.source.name == "modal"
            assert "with estimator modal" in next(e.why for e in robot.events if e.kind == "shaper_changed")
            assert left[shaper] < min(0.1 * left["none"], left["zv"]), shaper


def test_auto_target_arrives_sooner_than_auto_and_still_follows_streams():
    ticks = {}
    for name in ("auto", "auto-target"):
        robot = Robot(calibration=POLYNOMIAL, shaper=name)
        robot.send(c.MoveJ, q=tuple(Q3))
        ticks[name] = robot.until_rest().tick
        assert robot.states[-1].estimated_f_d[0] == pytest.approx(14.8, abs=1.0)
    assert ticks["auto-target"] < ticks["auto"]
    at_rest = robot.controller.cycle.tvist.f_d.copy()
    robot.stream(400, -0.2 * np.array([0, 1, 1, 0, 0, 0]), 2.0)
    assert abs(robot.states[-1].estimated_f_d[0] - at_rest[0]) > 0.02  # it follows the arm


def test_a_clipped_filter_sets_a_state_bit_and_emits_one_event():
    robot = Robot()
    estimator = robot.controller.cycle.tvist.estimator
    for now in (False, True, False, True):
        estimator.clipped = now
        robot.tick(3)
    bits = [state.shaper_clipped for state in robot.states]
    assert bits == [False] * 3 + [True] * 3 + [False] * 3 + [True] * 3
    said = [(event.tick, event.why[:2]) for event in robot.events if event.code == "out_of_range"]
    assert said == [(4, "zv"), (10, "zv")]
