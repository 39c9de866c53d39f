"""The closed form of Figure 2 is the arm's, and its frequency changes as the arm folds."""

import math
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
from msgspec.structs import replace

from tvist_controller.api.line import body, estimator_of, load_calibration, paper_payload
from tvist_lab.one_joint import ANGLES, MASSES, FlexibleShoulder, pluck, pluck_all
from tvist_plant.description import load
from tvist_plant.drives import DriveCommand
from tvist_plant.flexible_arm import FlexibleArm
from tvist_plant.model import rigid_model
from tvist_plant.plant import PERIOD
from tvist_shaping import flexible_joint

PAGE = Path(__file__).parents[2] / "docs" / "explanations" / "one-flexible-joint.md"
TOLERANCE = 0.005
"""Deviation of a simulated f_d from the formula that is allowed [-]."""


@pytest.fixture(scope="module")
def arm():
    return load("one-joint")


@pytest.fixture(scope="module")
def done():
    return pluck_all()


def disc(arm, mass):
    return body(paper_payload(arm, mass))


@pytest.mark.parametrize("mass", [0.0, 0.5, 1.0, 2.0])
def test_the_inertia_is_the_first_entry_of_the_mass_matrix_wherever_the_shoulder_is(arm, mass):
    payload = disc(arm, mass)
    formula, model = FlexibleShoulder.of(arm, payload), rigid_model(arm, payload)
    for shoulder, elbow in np.random.default_rng(0).uniform(-math.pi, math.pi, (20, 2)):
        M = pin.crba(model, model.createData(), np.array([shoulder, elbow]))
        assert formula.inertia(elbow) == pytest.approx(M[0, 0], rel=1e-12)


@pytest.mark.parametrize("mass", MASSES)
def test_simulated_frequencies_are_within_half_a_percent_of_the_formula(arm, mass, measured):
    """Fitted to the accelerometer, noise and friction included, at every angle of the figure."""
    assert len(ANGLES) >= 12
    payload = disc(arm, mass)
    formula = FlexibleShoulder.of(arm, payload)
    errors = [pluck(arm, payload, elbow).f_d / formula.mode(elbow)[0] - 1.0 for elbow in ANGLES]
    measured("largest deviation of f_d [%]", 100.0 * float(np.max(np.abs(errors))))
    assert np.max(np.abs(errors)) < TOLERANCE


@pytest.mark.parametrize(
    ("changes", "why"),
    [
        ({"gear_stiffness": (420.0 * 1.02, 200_000.0)}, "a spring that is 2 % stiffer"),
        ({"velocity_gain": (60.0, 20_000.0)}, "a motor that yields as the UR5e's does"),
        ({"gear_stiffness": (420.0, 2_000.0)}, "an elbow that gives way"),
    ],
)
def test_half_a_percent_is_tight_enough_to_find_another_arm(arm, changes, why):
    payload = disc(arm, 1.0)
    formula = FlexibleShoulder.of(arm, payload)
    other = replace(arm, drives=replace(arm.drives, **changes))
    errors = [pluck(other, payload, elbow).f_d / formula.mode(elbow)[0] - 1.0 for elbow in ANGLES]
    assert np.max(np.abs(errors)) > TOLERANCE, why


def test_zero_crossings_of_the_link_angle_say_the_same_as_the_accelerometer(arm):
    """A second way to read the frequency: no fit, no accelerometer."""
    payload = disc(arm, 1.0)
    formula, plant = FlexibleShoulder.of(arm, payload), FlexibleArm(arm, payload)
    for elbow in np.radians([30.0, 90.0, 150.0]):
        still = DriveCommand(np.array([0.0, elbow]), np.zeros(2), np.zeros(2))
        plant.reset(still)
        plant.push(np.array([2.0, 0.0]))
        for _ in range(500):
            plant.step(still)
        plant.push(np.zeros(2))
        angle = []
        for _ in range(500):
            plant.step(still)
            angle.append(plant.truth().gear_deflection[0])
        angle = np.array(angle)
        before = np.flatnonzero(angle[:-1] * angle[1:] < 0.0)
        crossings = PERIOD * (before + angle[before] / (angle[before] - angle[before + 1]))
        f_d = 0.5 * (len(crossings) - 1) / (crossings[-1] - crossings[0])
        assert f_d == pytest.approx(formula.mode(elbow)[0], rel=TOLERANCE)


@pytest.mark.parametrize("mass", [0.0, 1.0, 2.0])
def test_the_lowest_true_mode_is_the_formula_s(arm, mass):
    payload = disc(arm, mass)
    formula, plant = FlexibleShoulder.of(arm, payload), FlexibleArm(arm, payload)
    for elbow in ANGLES:
        modes, (f_d, zeta) = plant.modes(np.array([0.5, elbow])), formula.mode(elbow)
        assert modes.f_d[0] == pytest.approx(f_d, rel=1e-3)
        assert modes.zeta[0] == pytest.approx(zeta, rel=1e-2)
        assert modes.f_d[1] > 10.0 * f_d


def test_the_estimator_for_a_filter_is_the_formula_over_the_whole_range(arm):
    formula = FlexibleShoulder.of(arm, disc(arm, 1.0))
    estimator = formula.estimator()
    for elbow in np.linspace(-math.pi, math.pi, 25):
        f_d, zeta = estimator.estimate(np.array([1.0, elbow]))
        assert (f_d[0], zeta[0]) == flexible_joint(formula.inertia(elbow), 420.0, 1.05)
        assert not estimator.clipped


def test_the_calibration_that_ships_is_within_a_percent_of_the_formula(arm):
    calibration = load_calibration("one-joint_1kg")
    formula, estimator = FlexibleShoulder.of(arm, disc(arm, 1.0)), estimator_of(calibration)
    for elbow in np.radians(np.arange(-150.0, 151.0, 10.0)):
        (f_d,), (zeta,) = estimator.estimate(np.array([0.3, elbow]))
        assert f_d == pytest.approx(formula.mode(elbow)[0], rel=0.01)
        assert zeta == pytest.approx(formula.mode(elbow)[1], rel=0.05)


@pytest.mark.parametrize(
    "changes",
    [{"alpha": (math.pi / 2, 0.0)}, {"alpha": (0.0, 0.1)}],
)
def test_an_arm_whose_axes_are_not_vertical_has_no_such_formula(arm, changes):
    other = replace(arm, kinematics=replace(arm.kinematics, **changes))
    with pytest.raises(ValueError, match="two vertical axes"):
        FlexibleShoulder.of(other, arm.payload)


def test_the_ur5e_has_no_such_formula():
    ur5e = load("ur5e")
    with pytest.raises(ValueError, match="robot ur5e"):
        FlexibleShoulder.of(ur5e, ur5e.payload)


def test_inertia_falls_and_frequency_rises_over_the_three_angles_of_the_paper(done):
    modes = done.poses
    assert [round(math.degrees(mode.elbow)) for mode in modes] == [30, 90, 150]
    assert modes[0].inertia > modes[1].inertia > modes[2].inertia
    assert modes[0].simulated_f_d < modes[1].simulated_f_d < modes[2].simulated_f_d
    assert done.worst_f_d < 100.0 * TOLERANCE


def test_the_page_says_what_was_found(done):
    found = PAGE.read_text(encoding="utf-8")
    for one in done.poses:
        figures = (one.inertia, one.f_d, one.simulated_f_d, one.zeta, one.simulated_zeta)
        cells = [f"{value:.{digits}f}" for value, digits in zip(figures, (3, 2, 2, 3, 3), strict=True)]
        assert f"| {math.degrees(one.elbow):.0f}° | {' | '.join(cells)} |" in found
    assert f"within {done.worst_f_d:.2f} %, the damping ratios within {done.worst_zeta:.1f} %" in found


def test_figure_2_draws_the_formula_the_simulated_points_and_the_three_arms(done):
    from tvist_lab.figures import figure_2, house_style

    with house_style():
        figure = figure_2(done)
    arms, frequencies, _ = figure.axes
    words = [text.get_text() for text in arms.texts]
    assert [word for word in words if word.startswith("$q$")] == [f"$q$ = {q}°" for q in (30, 90, 150)]
    assert any("0.426 kg m²\nincreased inertia" in word for word in words)
    assert any("0.114 kg m²\ndecreased inertia" in word for word in words)
    lines = {line.get_label(): line.get_xydata() for line in frequencies.get_lines()}
    for mass in MASSES:
        formula, simulated = lines[f"{mass:g} kg, formula"], lines[f"{mass:g} kg, simulated"]
        assert len(simulated) == len(ANGLES)
        np.testing.assert_allclose(simulated, formula, rtol=TOLERANCE)
