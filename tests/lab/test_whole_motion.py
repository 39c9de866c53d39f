"""A whole motion in one go is what the controller's ticks are, to the last bit, for each kind of shaper."""

import numpy as np
import pytest

from tvist_controller.api.line import (
    ControlCycle,
    JointLine,
    body,
    load_calibration,
    paper_payload,
    quickest_motion,
)  # fmt: skip
from tvist_lab.study.line import PAPER, RESTING, ControlLine, point_to_point
from tvist_lab.study.moves import draw_moves
from tvist_lab.study.recipes import Recipe
from tvist_lab.study.shaping import RunningFilter, shape
from tvist_plant.drives import DriveCommand
from tvist_plant.flexible_arm import FlexibleArm
from tvist_plant.plant import PERIOD, PlantError, SimulatedArm
from tvist_shaping.named import BUILT_IN


def by_ticks(description, recipe, move, seed):
    """Specific force and measurements of the controller's own ticks."""
    start, carried = np.array(move.start), body(paper_payload(description, move.mass))
    tvist = recipe.make(description, move.mass)
    cycle = ControlCycle(
        description, tvist, q=start, declared=carried, carried=carried, seed=seed,
        elastic=recipe.elastic(description, tvist),
    )  # fmt: skip
    samples = [cycle.step() for _ in range(RESTING)]
    forces = [cycle.plant.truth().specific_force] * RESTING
    cycle.begin(quickest_motion(JointLine(start, np.array(move.target)), PAPER))
    while not cycle.mode.at_rest:
        samples.append(cycle.step())
        forces.append(cycle.plant.truth().specific_force)
    return samples, np.array(forces)


def in_one_go(description, recipe, move, seed):
    start, target = np.array(move.start), np.array(move.target)
    carried = body(paper_payload(description, move.mass))
    tvist, reference = recipe.make(description, move.mass), point_to_point(start, target)
    tvist.reset(start)
    for _ in range(RESTING):  # some filters go on at rest
        tvist.filter(start)
    shaped = shape(RunningFilter(tvist), reference, watched=False)
    assert shaped.ended
    line, arm = ControlLine(description, start, carried), FlexibleArm(description, carried)
    following = line.follow(reference, shaped.q, elastic=recipe.elastic(description, tvist))
    return following.simulate(arm, seed)


@pytest.mark.parametrize(
    "name", ["none", "zv", "ei3", "auto", "short", "elastic", "elastic-auto", "the paper's"]
)
def test_whole_motion_equals_the_ticks_of_the_controller(ur5e, name):
    names, paper = BUILT_IN.names(), name == "the paper's"
    recipe = Recipe("zv" if paper else name, load_calibration("ur5e_5kg" if paper else "ur5e_modal"))
    number = 5 if paper else names.index(name)
    (move,) = draw_moves(ur5e, 1, number, (0.0, 5.0), wrists=not paper).moves
    samples, forces = by_ticks(ur5e, recipe, move, number)
    recording = in_one_go(ur5e, recipe, move, number)
    ticks = min(len(samples), len(recording))
    assert ticks > 200
    late = round(recording["shaper_delay"][0] / PERIOD)
    wanted = np.array([sample.target.q for sample in samples])
    np.testing.assert_array_equal(recording["target_q"][late:ticks], wanted[: ticks - late])
    np.testing.assert_array_equal(recording["truth_tool_acceleration"][RESTING:ticks], forces[RESTING:ticks])


def commands(description, ticks):
    q = np.array(description.poses["Q1"]) + 0.3 * np.sin(0.01 * np.arange(ticks))[:, None] ** 3
    return np.stack([q, np.gradient(q, PERIOD, axis=0), np.zeros_like(q)], axis=1)


def test_played_motion_equals_single_steps(ur5e):
    made = commands(ur5e, 400)
    arms = [FlexibleArm(ur5e, ur5e.payload) for _ in range(2)]
    for arm in arms:
        arm.reset(DriveCommand(made[0, 0], np.zeros(6), np.zeros(6)), seed=3)
    for part in (made[:150], made[150:300], made[300:]):
        one, other = arms[0].play(part), SimulatedArm.play(arms[1], part)
        for name in ("specific_force", "flange_position", "flange_rotation"):
            np.testing.assert_array_equal(getattr(one, name), getattr(other, name))
        for name in ("q", "qd", "moment", "accelerometer"):
            np.testing.assert_array_equal(getattr(one.measured, name), getattr(other.measured, name))
        for arm in arms:
            arm.push(np.array([0.0, 20.0, 0.0, 0.0, 1.0, 0.0]))


def test_failure_of_the_arm_is_reported(ur5e):
    made = commands(ur5e, 20)
    arm = FlexibleArm(ur5e, ur5e.payload)
    arm.reset(DriveCommand(made[0, 0], np.zeros(6), np.zeros(6)))
    made[7] = np.nan
    with pytest.raises(PlantError):
        arm.play(made)
