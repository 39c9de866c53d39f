"""What everyday motions tell of a robot: which stops count, what is known where, and the twin that they give."""

import asyncio
from contextlib import suppress
from dataclasses import replace

import msgspec
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tvist_controller.api.line import CollisionModel, body, paper_payload
from tvist_lab.collect import collect
from tvist_lab.identification.calibrate import agreeing, calibrate, more_jogs
from tvist_lab.identification.design import free_configurations, jog_of, predicted
from tvist_lab.identification.forecast import ModeForecast
from tvist_lab.identification.jogs import RingDownLogs
from tvist_lab.identification.modal_fit import describe, fit_modal, of_masses
from tvist_lab.identification.observed import mounting_of, observe, repeated
from tvist_lab.identification.ring_downs import (
    CONTRADICTS,
    LEAST_NOISE,
    IdentificationError,
    Log,
    noise_of,
    stops_of,
    unused,
)
from tvist_lab.identification.twin import fit_twin
from tvist_lab.identification.twin_file import toml_of, twin_file
from tvist_lab.identification.twin_parameters import TwinParameters
from tvist_lab.identification.unknowns import Z_95, ArmModes
from tvist_lab.in_process import free_setup, robot_in_process
from tvist_lab.metrics import MotionRows, fit_ring_down, motions, tool_acceleration
from tvist_lab.recordings import Recording, RecordingError
from tvist_lab.study.line import RESTING, ControlLine, point_to_point
from tvist_plant.description import load, robots
from tvist_plant.plant import PERIOD
from tvist_plant.variants import hidden_variant
from tvist_protocol.errors import RefusedError

FEW, MANY = ((0.0, 2), (0.5, 3), (0.9, 2)), ((0.0, 6), (0.5, 7), (0.9, 7))
"""Carried masses over the rated payload, and the number of motions with each: seven or twenty."""
LINE = 0.25  # largest way of a straight line along each axis [m]


def anywhere(random):
    """Return a posture as programs use them, shape (6,) [rad]."""
    return random.uniform(
        [-np.pi, -np.pi, -2.6, -np.pi, -np.pi, -np.pi], [np.pi, 0.0, 2.6, 0.0, np.pi, np.pi]
    )


async def everyday_logs(robot, hidden, seed, shares=MANY):
    """Record motions as a user's program makes them: two of three by the joints, the third on a line.

    Only what a robot publishes is recorded; the robot is unshaped, and rests for 0.3 to 1.2 s after each motion.
    """
    rated = load(robot).limits.payload
    return [
        await _log(robot, hidden, share * rated, count, seed * 10 + number)
        for number, (share, count) in enumerate(shares)
    ]


async def _log(robot, hidden, mass, count, seed):
    setup = free_setup(
        robot=robot, payload=mass, hidden=hidden, truth=False, shaper="none", calibration="none", seed=seed
    )
    random, made = np.random.default_rng([seed, hidden]), 0
    async with robot_in_process(setup) as client, client.control("everyday") as arm:
        info = await client.info()
        with collect(client) as collected:
            await client.advance(100)
            while made < count:
                # What is out of reach or has something in the way is refused: a program would have another pose.
                with suppress(RefusedError):
                    await (_line if made % 3 == 2 else _joints)(client, arm, random)
                    made += 1
                    await client.advance(round(random.uniform(0.3, 1.2) / PERIOD))
    return Log(f"{mass:g} kg", replace(collected.recording(), info=info))


async def _line(client, arm, random):
    x, y, z, *turn = await client.forward_kinematics()
    goal = [*(np.array([x, y, z]) + random.uniform(-LINE, LINE, 3)).tolist(), *turn]
    await arm.move_l(goal, velocity=random.uniform(0.2, 0.5), acceleration=random.uniform(0.8, 1.5))


async def _joints(client, arm, random):
    here = np.array((await client.state()).target_q)
    q = here + random.uniform(0.2, 0.8) * (anywhere(random) - here)
    await arm.move_j(q, velocity=random.uniform(0.8, 1.6), acceleration=random.uniform(1.4, 2.5))


def unseen(description, hidden, count, seed):
    """Return postures where the robot rings loud enough, the declared payloads in turn, and the lowest frequency there.

    It is that of the arm linearised at rest, in which gears have no hysteresis.
    """
    random, found = np.random.default_rng([seed, 71]), []
    while len(found) < count:
        share, _ = MANY[len(found) % len(MANY)]
        declared = paper_payload(description, share * description.limits.payload)
        q = anywhere(random)
        start = q + random.uniform(-0.6, 0.6, len(q))
        arm = hidden_variant(hidden).make(description, body(declared), 0)
        reference = point_to_point(start, q)
        made = ControlLine(description, start, body(declared)).follow(reference, reference).simulate(arm, 0)
        alpha = tool_acceleration(made, truth=True)[RESTING + len(reference) + 1 :]
        if fit_ring_down(alpha, PERIOD, modes=2, slow_poles=(17.5, 6.0), offset=True, skip=0.014).ok:
            found.append((q, declared, float(arm.modes(q).f_d[0])))
    return found


ROBOT = load("ur5e")
PAYLOADS = (paper_payload(ROBOT, 0.0), paper_payload(ROBOT, 5.0))


@pytest.fixture(scope="module")
def logs():
    """Seven motions of a hidden robot."""
    return asyncio.run(everyday_logs("ur5e", 21, 4, FEW))


@pytest.fixture(scope="module")
def many_logs():
    """Twenty motions of the same robot."""
    return asyncio.run(everyday_logs("ur5e", 21, 4))


@pytest.mark.parametrize("held", [1, 4])
def test_noise_of_a_sensor_does_not_depend_on_repeated_rows(held):
    """A robot that sends 125 rows a second gets each row four times in a recording at 500 Hz."""
    rows, motion = np.arange(4000), MotionRows(start=0, reference_stop=100, shaped_stop=100, end=4000)
    vibration = np.sin(2.0 * np.pi * 5.0 * 0.002 * rows)[:, None] * np.exp(-rows / 200.0)[:, None]
    measured = vibration + np.random.default_rng(5).normal(0.0, 0.03, (4000, 3))
    columns = {
        "tick": rows,
        "timestamp": 0.002 * rows,
        "actual_tool_accelerometer": measured[rows - rows % held],
    }
    assert noise_of(Recording(columns), motion) == pytest.approx(0.03, rel=0.15)
    silent = Recording({**columns, "actual_tool_accelerometer": np.zeros((4000, 3))})
    assert noise_of(silent, motion) == LEAST_NOISE


@pytest.fixture(scope="module")
def forecast():
    """A fit to ring-downs of the arm as its file has it, with noise."""
    arm = ArmModes(ROBOT, PAYLOADS)
    rng = np.random.default_rng(3)
    places = free_configurations(ROBOT, PAYLOADS, 6, 2)
    rings = [noisy(predicted(arm, q, number % 2), rng) for number, q in enumerate(places)]
    fit = fit_modal(arm, rings)
    return ModeForecast(arm, fit, fit.covariance, of_masses(arm, rings, fit)), rings


def changed(log, **columns):
    """The same log with other columns; without one that is None."""
    recording = log.recording
    both = {**recording.columns, **columns}
    there = {name: column for name, column in both.items() if column is not None}
    return replace(log, recording=replace(recording, columns=there))


def test_every_stop_is_used_or_has_a_reason(logs):
    stops, payloads = stops_of(logs)
    assert len(stops) == 7
    assert [payload.mass for payload in payloads] == [0.0, 2.5, 4.5]
    assert all((stop.ring_down is None) == bool(stop.reason) for stop in stops)
    assert sum(stop.ring_down is not None for stop in stops) >= 5


def test_shaped_and_quiet_stops_are_not_used(logs):
    force = logs[1].recording["actual_tool_accelerometer"]
    noise = np.random.default_rng(0).normal(0.0, 2.0, force.shape)
    for other, reason in (
        ({"shaper_delay": np.full(len(force), 0.05)}, "the motion was shaped"),
        ({"actual_tool_accelerometer": force + noise}, "the vibration does not stand out of the noise"),
    ):
        stops, _ = stops_of([changed(logs[1], **other)])
        assert {stop.reason for stop in stops} == {reason}


def test_log_without_accelerometer_or_targets_is_refused(logs):
    with pytest.raises(IdentificationError, match=r"0 of 3 stops.*actual_tool_accelerometer.*Record"):
        agreeing(ROBOT, [changed(logs[1], actual_tool_accelerometer=None)], lambda _: None)
    with pytest.raises(RecordingError, match="has no target_q"):
        observe([changed(logs[0], target_q=None)], PAYLOADS)


def test_log_without_payload_is_refused_unless_it_is_given(logs):
    mute = replace(logs[1], recording=replace(logs[1].recording, info=None))
    with pytest.raises(RecordingError, match="give --payload MASS"):
        stops_of([mute])
    assert stops_of([replace(mute, payload=PAYLOADS[1])])[1] == PAYLOADS[1:]
    rows = np.arange(len(logs[1].recording))
    told = changed(logs[1], payload=np.where(rows < len(rows) // 2, 1.0, 2.0))
    assert [payload.mass for payload in stops_of([told])[1]] == [1.0, 2.0]


@pytest.mark.nightly
def test_stops_with_an_undeclared_payload_are_rejected(many_logs):
    recording = asyncio.run(everyday_logs("ur5e", 21, 9))[2].recording
    third = int(recording["tick"][motions(recording)[2].start])
    wrong = Log("wrong", recording.between(0, third), PAYLOADS[0])
    stops, *_ = agreeing(ROBOT, [*many_logs, wrong], lambda _: None)
    assert [(s.log, s.motion) for s in stops if s.reason == CONTRADICTS] == [("wrong", 1), ("wrong", 2)]


def test_intervals_contain_the_true_modes(forecast):
    known, _ = forecast
    arm, held = known.arm, []
    for q in free_configurations(ROBOT, PAYLOADS, 20, 9):
        f_d, zeta = describe(arm.drivetrain(arm.guess).poles(arm.mass(q, 1))[0][:2])
        there = known.at(q, 1, 2)
        held += [
            *(np.abs(np.log(there.f_d / f_d)) < Z_95 * there.f_d_error),
            *(np.abs(np.log(there.zeta / zeta)) < Z_95 * there.zeta_error),
        ]
    assert np.mean(held) >= 0.9


def noisy(ring, rng):
    return replace(ring, force=ring.force + rng.normal(0.0, ring.noise, ring.force.shape))


def test_proposed_jogs_are_free_and_reduce_the_uncertainty(forecast):
    known, rings = forecast
    found, rng = more_jogs(known, rings[-1]), np.random.default_rng(5)
    assert len(found) == 3
    collisions, at, more = CollisionModel(ROBOT, body(PAYLOADS[1])), rings[-1].q, list(rings)
    for one in found:
        for after in (*one.way, one.q):
            between = [at + share * (after - at) for share in np.linspace(0.0, 1.0, 100)]
            assert all(collisions.meeting(q) is None for q in between)
            at = after
        assert one.q - one.way[-1] == pytest.approx(jog_of(6))
        more.append(noisy(predicted(known.arm, one.q, rings[-1].payload), rng))
    before, after = (np.linalg.slogdet(fit_modal(known.arm, some).covariance)[1] for some in (rings, more))
    assert after < before - 1.0


@pytest.mark.nightly
def test_intervals_contain_modes_at_unmeasured_poses_of_hidden_robots(many_logs):
    found = calibrate(ROBOT, RingDownLogs(tuple(many_logs)), name="x", command="x", progress=lambda _: None)
    assert found.used + sum(unused(found.stops).values()) == 20
    assert "38 are needed" in found.no_polynomial
    held, sure = [], []
    for q, declared, f_d in unseen(ROBOT, 21, 20, 0):
        known = found.forecast.at(q, found.forecast.arm.payloads.index(declared), 3)
        error = abs(np.log(known.f_d[0] / f_d))
        held.append(error < Z_95 * known.f_d_error[0])
        if known.f_d_percent[0] <= 5.0:
            sure.append(error)
    assert np.mean(held) >= 0.9
    assert len(sure) >= 7
    assert np.quantile(sure, 0.95) < 0.05


@pytest.mark.parametrize("name", robots())
def test_written_robot_file_reads_back_equal(name, tmp_path):
    path = tmp_path / "robot.toml"
    path.write_text(toml_of(load(name)), encoding="utf-8")
    assert load(path) == load(name)


@pytest.fixture
def twin_numbers():
    """The parameters of a twin, and its numbers for the robot file as it is."""
    parameters = TwinParameters(ROBOT, PAYLOADS)
    return parameters, np.zeros(len(parameters.entries))


def test_parameters_of_zero_leave_the_robot_file_unchanged(twin_numbers):
    parameters, values = twin_numbers
    same = parameters.robot(values, 1)
    assert (same.drives, same.link_flexibility) == (ROBOT.drives, ROBOT.link_flexibility)
    assert same.payload.mass == PAYLOADS[1].mass


def test_softer_gears_keep_the_lead_of_feed_forward(twin_numbers):
    parameters, values = twin_numbers
    values[parameters.index("drives", "gear_stiffness", 1)] = np.log(0.8)
    softer = parameters.robot(values).drives
    assert softer.gear_stiffness[1] == pytest.approx(0.8 * ROBOT.drives.gear_stiffness[1])
    leads = [np.array(one.windup_feedforward) / one.gear_stiffness for one in (softer, ROBOT.drives)]
    assert leads[0] == pytest.approx(leads[1])


def test_each_payload_has_its_own_nonnegative_mass(twin_numbers):
    parameters, values = twin_numbers
    values[parameters.index("payload", "mass", 0)] = -1.0  # the index of the first payload is its place
    assert parameters.payload(values, 0).mass == 0.0
    assert parameters.payload(values, 1) == PAYLOADS[1]


def test_twin_of_an_exact_robot_file_repeats_the_motion(logs):
    seen, others = observe(logs, tuple(dict.fromkeys(log.carried(0) for log in logs)))
    assert len(seen) + len(others) == 7
    one = seen[0]
    response = repeated(ROBOT, PAYLOADS[0], one)
    ticks, angles = one.angles
    rows = np.arange(len(response.measured.q))
    there = np.array([np.interp(ticks, rows, q) for q in response.measured.q.T]).T
    assert np.max(np.abs(there - angles)) < 0.01


def test_rotated_accelerometer_is_found():
    rng = np.random.default_rng(0)
    turn = Rotation.from_rotvec([0.3, -1.2, 2.0]).as_matrix()
    force = rng.normal(0.0, 5.0, (200, 3))
    assert mounting_of([(force, force @ turn.T)]) == pytest.approx(turn)


@pytest.mark.nightly
def test_twin_of_a_hidden_robot_predicts_unseen_motions(tmp_path):
    logs, checks = (asyncio.run(everyday_logs("ur5e", 22, seed)) for seed in (5, 6))
    twin = fit_twin(ROBOT, logs, checks, lambda _: None)
    assert twin.checked
    assert twin.error_percent(0.5) < 20.0
    assert twin.error_percent(0.9) < 40.0
    path = tmp_path / "twin.toml"
    path.write_text(twin_file(twin, "tvist identify --twin"), encoding="utf-8")
    served = load(path)
    assert msgspec.structs.replace(served, provenance=twin.robot.provenance) == twin.robot
    assert served.provenance["drives.coulomb_friction"].startswith("measured")
    assert "has not seen" in path.read_text(encoding="utf-8")
