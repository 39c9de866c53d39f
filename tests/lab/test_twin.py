"""A twin: the robot file that logs give, what it changes of the file, and how it reads back."""

import asyncio

import numpy as np
import pytest
from msgspec.structs import replace
from scipy.spatial.transform import Rotation
from tests.lab.everyday import everyday_logs

from tvist_controller.api.line import paper_payload
from tvist_lab.identification.observed import mounting_of, observe, repeated
from tvist_lab.identification.twin import fit_twin
from tvist_lab.identification.twin_file import toml_of, twin_file
from tvist_lab.identification.twin_parameters import TwinParameters
from tvist_lab.recordings import RecordingError
from tvist_plant.description import load, robots

ROBOT = load("ur5e")
PAYLOADS = (paper_payload(ROBOT, 0.0), paper_payload(ROBOT, 5.0))


@pytest.fixture(scope="module")
def logs():
    """Motions of a hidden robot."""
    return asyncio.run(everyday_logs("ur5e", 22, 5))


@pytest.mark.parametrize("name", robots())
def test_a_robot_file_that_is_written_reads_back_the_same(name, tmp_path):
    path = tmp_path / "robot.toml"
    path.write_text(toml_of(load(name)), encoding="utf-8")
    assert load(path) == load(name)


def test_numbers_of_zero_leave_the_robot_as_its_file_has_it():
    parameters = TwinParameters(ROBOT, PAYLOADS)
    same = parameters.robot(np.zeros(len(parameters.entries)), 1)
    assert same.drives == ROBOT.drives
    assert same.link_flexibility == ROBOT.link_flexibility
    assert same.payload.mass == PAYLOADS[1].mass


def test_softer_gears_are_led_as_much_as_before():
    parameters = TwinParameters(ROBOT, PAYLOADS)
    values = np.zeros(len(parameters.entries))
    values[parameters.index("drives", "gear_stiffness", 1)] = np.log(0.8)
    softer = parameters.robot(values).drives
    assert softer.gear_stiffness[1] == pytest.approx(0.8 * ROBOT.drives.gear_stiffness[1])
    leads = [np.array(one.windup_feedforward) / one.gear_stiffness for one in (softer, ROBOT.drives)]
    assert leads[0] == pytest.approx(leads[1])


def test_each_payload_has_a_mass_of_its_own_which_is_never_negative():
    parameters = TwinParameters(ROBOT, PAYLOADS)
    values = np.zeros(len(parameters.entries))
    values[parameters.index("payload", "mass", 0)] = -1.0  # the index of the first payload is its place
    assert parameters.payload(values, 0).mass == 0.0
    assert parameters.payload(values, 1) == PAYLOADS[1]


def test_a_robot_that_is_its_file_is_repeated_as_it_was(logs):
    seen, others = observe(logs, tuple(dict.fromkeys(log.carried(0) for log in logs)))
    assert len(seen) + len(others) == 20
    one = seen[0]
    response = repeated(ROBOT, PAYLOADS[0], one)
    ticks, angles = one.angles
    there = np.array(
        [np.interp(ticks, np.arange(len(response.measured.q)), q) for q in response.measured.q.T]
    ).T
    assert np.max(np.abs(there - angles)) < 0.01


def test_a_log_without_targets_has_no_twin(logs):
    from dataclasses import replace as changed

    columns = {name: value for name, value in logs[0].recording.columns.items() if name != "target_q"}
    blind = changed(logs[0], recording=changed(logs[0].recording, columns=columns))
    with pytest.raises(RecordingError, match="has no target_q"):
        observe([blind], PAYLOADS)


def test_a_turned_accelerometer_is_found():
    rng = np.random.default_rng(0)
    turn = Rotation.from_rotvec([0.3, -1.2, 2.0]).as_matrix()
    force = rng.normal(0.0, 5.0, (200, 3))
    assert mounting_of([(force, force @ turn.T)]) == pytest.approx(turn)


@pytest.mark.nightly
def test_a_twin_of_a_hidden_robot_predicts_what_it_has_not_seen(logs, tmp_path):
    checks = asyncio.run(everyday_logs("ur5e", 22, 6))
    twin = fit_twin(ROBOT, logs, checks, lambda _: None)
    assert twin.checked
    assert twin.error_percent(0.5) < 20.0
    assert twin.error_percent(0.9) < 40.0
    path = tmp_path / "twin.toml"
    path.write_text(twin_file(twin, "tvist identify --twin"), encoding="utf-8")
    served = load(path)
    assert replace(served, provenance=twin.robot.provenance) == twin.robot
    assert served.provenance["drives.coulomb_friction"].startswith("measured")
    assert "has not seen" in path.read_text(encoding="utf-8")
