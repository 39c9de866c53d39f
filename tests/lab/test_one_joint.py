"""The closed form of Figure 2 is the arm's, and its frequency changes as the arm folds."""

import math
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
from msgspec.structs import replace

from tvist_controller.api.line import body, estimator_of, load_calibration, paper_payload
from tvist_lab.one_joint import ANGLES, FlexibleShoulder, pluck_all
from tvist_plant.description import load
from tvist_plant.flexible_arm import FlexibleArm
from tvist_plant.model import rigid_model
from tvist_shaping import flexible_joint

ARM = load("one-joint")
PAGE = Path(__file__).parents[2] / "docs" / "explanations" / "one-flexible-joint.md"


def disc(mass):
    return body(paper_payload(ARM, mass))


def test_inertia_equals_that_of_the_mass_matrix():
    payload = disc(2.0)
    formula, model = FlexibleShoulder.of(ARM, payload), rigid_model(ARM, payload)
    for q in np.random.default_rng(0).uniform(-math.pi, math.pi, (20, 2)):
        M = pin.crba(model, model.createData(), q)
        assert formula.inertia(q[1]) == pytest.approx(M[0, 0], rel=1e-12)


def test_lowest_true_mode_agrees_with_the_formula():
    payload = disc(1.0)
    formula, plant = FlexibleShoulder.of(ARM, payload), FlexibleArm(ARM, payload)
    for elbow in ANGLES:
        modes, (f_d, zeta) = plant.modes(np.array([0.5, elbow])), formula.mode(elbow)
        assert modes.f_d[0] == pytest.approx(f_d, rel=1e-3)
        assert modes.zeta[0] == pytest.approx(zeta, rel=1e-2)
        assert modes.f_d[1] > 10.0 * f_d


def test_estimator_agrees_with_the_formula():
    formula = FlexibleShoulder.of(ARM, disc(1.0))
    estimator = formula.estimator()
    for elbow in np.linspace(-math.pi, math.pi, 25):
        f_d, zeta = estimator.estimate(np.array([1.0, elbow]))
        assert (f_d[0], zeta[0]) == flexible_joint(formula.inertia(elbow), 420.0, 1.05)
        assert not estimator.clipped


def test_shipped_calibration_agrees_with_the_formula():
    calibration = load_calibration("one-joint_1kg")
    formula, estimator = FlexibleShoulder.of(ARM, disc(1.0)), estimator_of(calibration)
    for elbow in np.radians(np.arange(-150.0, 151.0, 10.0)):
        (f_d,), (zeta,) = estimator.estimate(np.array([0.3, elbow]))
        assert f_d == pytest.approx(formula.mode(elbow)[0], rel=0.01)
        assert zeta == pytest.approx(formula.mode(elbow)[1], rel=0.05)


def test_arm_without_vertical_axes_has_no_formula():
    leaning = replace(ARM, kinematics=replace(ARM.kinematics, alpha=(0.0, 0.1)))
    for other in (leaning, load("ur5e")):
        with pytest.raises(ValueError, match=f"two vertical axes|robot {other.robot.name}"):
            FlexibleShoulder.of(other, other.payload)


def test_page_has_the_computed_values():
    done = pluck_all()
    assert done.worst("f_d") < 0.5
    assert [round(math.degrees(one.elbow)) for one in done.poses] == [30, 90, 150]
    found = PAGE.read_text(encoding="utf-8")
    for one in done.poses:
        figures = (one.inertia, one.f_d, one.simulated_f_d, one.zeta, one.simulated_zeta)
        cells = [f"{value:.{digits}f}" for value, digits in zip(figures, (3, 2, 2, 3, 3), strict=True)]
        assert f"| {math.degrees(one.elbow):.0f}° | {' | '.join(cells)} |" in found
    assert f"within {done.worst('f_d'):.2f} %, the damping ratios within {done.worst('zeta'):.1f} %" in found
