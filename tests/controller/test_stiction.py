"""Feed-forward of stiction: the plant's own equation along the commanded motion, for filters that are made for it."""

import msgspec
import numpy as np
import pytest
from tests.controller.robots import PAPER, Q1, Q2, Q3, H, Line

from tvist_controller.line.elastic_lead import STICTION as OF_ELASTIC
from tvist_controller.line.joint_controllers import LAWS, STICTION, described_friction
from tvist_controller.planning.filter_planner import FilterPlanner
from tvist_controller.setup import Setup, body, paper_payload
from tvist_controller.sources.calibrations import default_for, load
from tvist_controller.trajectory import JointLine, MotionLimits, quickest_motion
from tvist_plant import description as robot_files
from tvist_plant.flexible_arm import FlexibleArm
from tvist_plant.imperfections import Imperfections
from tvist_plant.integrator import rows
from tvist_plant.robot_tables import RobotDescription

STICKS, UR5E = robot_files.load("ur5e_stiction"), robot_files.load("ur5e")
MODAL = load("ur5e_stiction_modal")
LARGEST = Imperfections.of(STICKS).stiction[0]


def planned(shaper, description=STICKS, calibration=MODAL):
    setup = Setup(description, tuple(Q1), paper_payload(description), calibration, shaper=shaper)
    return FilterPlanner(setup).first()


def line(shaper, plant=None, description=STICKS):
    chosen, payload = planned(shaper, description), body(paper_payload(description))
    return Line(
        description, chosen.tvist, elastic=chosen.elastic, law=chosen.law, q=np.array(Q1), declared=payload,
        carried=payload, seed=1, plant=plant,
    )  # fmt: skip


def move(cycle, target, limits=PAPER):
    """Make a motion, and yield its samples with 0.6 s of rest."""
    cycle.begin(quickest_motion(JointLine(cycle.sample.reference, np.array(target)), limits, H))
    cycle.tvist.aim(np.array(target))
    rest = 0
    while rest < 300:
        yield cycle.step()
        rest = rest + 1 if cycle.mode.at_rest else 0


def rigid(description: RobotDescription) -> RobotDescription:
    """The arm with gears and links a hundred times as stiff, whose drives hold their motors on the commands."""
    replace, drives, links = msgspec.structs.replace, description.drives, description.link_flexibility
    stiff = replace(
        drives,
        gear_stiffness=tuple(100.0 * value for value in drives.gear_stiffness),
        velocity_gain=tuple(100.0 * value for value in drives.velocity_gain),
        windup_feedforward=(0.0,) * description.joints,
        gear_error_amplitude=0.0,
    )
    own = description.imperfections
    return replace(
        description,
        drives=stiff,
        link_flexibility=replace(links, stiffness=tuple(100.0 * value for value in links.stiffness)),
        imperfections=own | {"stiction_stiffness": 0.01 * own["stiction_stiffness"]},
    )


@pytest.mark.parametrize("limits", [PAPER, MotionLimits(0.05, 0.2, 10.0)], ids=["paper", "creeping"])
def test_it_equals_the_plants_own_stiction_in_a_motion_that_is_followed(limits, measured):
    """There and back, so that every motor turns round while it is held."""
    description = rigid(STICKS)
    plant = FlexibleArm(description, description.payload, substeps=16)
    cycle = line("auto", plant, description)
    truly = rows(plant._arm.state, description.joints).d
    way = np.array(Q1) + 0.3 * (np.array(Q3) - np.array(Q1))
    found = [
        (cycle.drives.rows[STICTION].copy(), truly.copy())
        for target in (way, Q1)
        for sample in move(cycle, target, limits)
        if sample.command.qd.any()
    ]
    fed, felt = np.array(found).transpose(1, 0, 2)
    rms, largest = np.sqrt(np.mean((fed - felt) ** 2)), np.abs(felt).max()
    measured("largest stiction, rms of the difference [N m]", (largest, rms))
    assert largest > LARGEST
    assert rms < 0.01 * largest


@pytest.mark.parametrize(
    "shaper", ["auto", "auto-target", "short", "elastic", "elastic-16", "elastic-auto", "elastic-position"]
)
def test_filters_made_for_known_friction_get_that_of_the_robot_file_in_full(shaper):
    chosen = planned(shaper)
    assert chosen.law.shape == (LAWS, STICKS.joints)
    np.testing.assert_array_equal(chosen.law, described_friction(STICKS))


@pytest.mark.parametrize("shaper", ["none", "zv", "zvd", "ei"])
def test_the_papers_controller_keeps_its_share_of_coulomb_friction(shaper):
    assert planned(shaper).law is None
    assert planned(shaper, calibration=load(default_for(STICKS.robot.model))).law is None


@pytest.mark.parametrize("shaper", ["zv", "auto", "elastic"])
def test_an_arm_whose_motors_do_not_stick_has_none(shaper):
    assert described_friction(UR5E) is None
    assert planned(shaper, UR5E, load("ur5e_modal")).law is None


def test_a_linear_arm_is_fed_its_linear_friction():
    law, drives = described_friction(STICKS.clean()), STICKS.drives
    assert (law[0] == 0.0).all()
    assert law[4] == pytest.approx(np.array(drives.coulomb_friction) / drives.friction_width)


@pytest.mark.parametrize(("first", "then"), [("auto", "elastic"), ("elastic", "auto"), ("elastic", "zv")])
def test_a_change_of_the_filter_at_rest_changes_no_torque(first, then):
    """The stiction that holds the motors is kept, since a torque that ended would shake the arm."""
    cycle = line(first)
    for _ in move(cycle, 0.5 * (np.array(Q1) + np.array(Q2))):
        pass
    before = cycle.sample.command.torque.copy()
    assert np.abs(cycle.drives.rows[STICTION]).max() > 0.9 * LARGEST
    chosen = planned(then)
    cycle.drives.compensate(chosen.law)
    cycle.use(chosen.tvist, chosen.elastic)
    for _ in range(5):
        cycle.step()
        assert np.abs(cycle.sample.command.torque - before).max() < 0.05 * LARGEST
    if chosen.elastic is not None:
        assert np.abs(chosen.elastic.lead.drives[OF_ELASTIC]).max() > 0.9 * LARGEST


def test_it_lessens_what_remains_of_a_motion():
    """Beside the same filter with a share of Coulomb friction, on the same arm that sticks."""
    unaware = msgspec.structs.replace(STICKS, imperfections={})
    left = {}
    for known in (STICKS, unaware):
        cycle = line("auto", FlexibleArm(STICKS, STICKS.payload), known)
        force = np.array([cycle.plant.truth().specific_force for _ in move(cycle, Q3)])
        left[known is STICKS] = np.linalg.norm(force - force[-1], axis=1)[-295:].max()
    assert left[True] < 0.6 * left[False]
