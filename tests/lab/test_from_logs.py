"""What everyday stops tell: which of them count, what is known where, and which moves would tell more."""

import asyncio
from dataclasses import replace

import numpy as np
import pytest
from tests.lab.everyday import everyday_logs, unseen

from tvist_controller.api.line import CollisionModel, body, paper_payload
from tvist_lab.identification.calibrate import agreeing, calibrate, more_jogs
from tvist_lab.identification.design import free_configurations, jog_of, predicted
from tvist_lab.identification.forecast import Forecast
from tvist_lab.identification.jogs import Measured
from tvist_lab.identification.modal_fit import describe, fit_modal, of_masses
from tvist_lab.identification.ring_downs import (
    CONTRADICTS,
    LEAST_NOISE,
    IdentificationError,
    Log,
    noise_of,
    stops_of,
    unused,
)
from tvist_lab.identification.unknowns import SURE, ArmModes
from tvist_lab.metrics import MotionRows, motions
from tvist_lab.recordings import Recording, RecordingError
from tvist_plant.description import load

ROBOT = load("ur5e")
PAYLOADS = (paper_payload(ROBOT, 0.0), paper_payload(ROBOT, 5.0))


@pytest.fixture(scope="module")
def logs():
    """Twenty motions of a hidden robot."""
    return asyncio.run(everyday_logs("ur5e", 21, 4))


@pytest.mark.parametrize("held", [1, 4])
def test_the_noise_of_a_sensor_is_the_same_where_rows_are_repeated(held):
    """A robot that sends 125 rows a second gets each row four times in a recording at 500 Hz."""
    rows = np.arange(4000)
    vibration = np.sin(2.0 * np.pi * 5.0 * 0.002 * rows)[:, None] * np.exp(-rows / 200.0)[:, None]
    measured = vibration + np.random.default_rng(5).normal(0.0, 0.03, (len(rows), 3))
    assert _noise(measured[rows - rows % held]) == pytest.approx(0.03, rel=0.15)


def test_an_arm_without_a_sensor_has_the_smallest_noise():
    assert _noise(np.zeros((4000, 3))) == LEAST_NOISE


def _noise(measured):
    """Noise by a recording at 500 Hz, all of it one motion."""
    rows = np.arange(len(measured))
    columns = {"tick": rows, "timestamp": 0.002 * rows, "actual_tool_accelerometer": measured}
    return noise_of(
        Recording(columns), MotionRows(start=0, reference_stop=100, shaped_stop=100, end=len(rows))
    )


@pytest.fixture(scope="module")
def forecast():
    """A fit to ring-downs of the arm as its file has it, with noise."""
    arm = ArmModes(ROBOT, PAYLOADS)
    rng = np.random.default_rng(3)
    rings = []
    for number, q in enumerate(free_configurations(ROBOT, PAYLOADS, 6, 2)):
        ring = predicted(arm, q, number % 2)
        rings.append(replace(ring, force=ring.force + rng.normal(0.0, ring.noise, ring.force.shape)))
    fit = fit_modal(arm, rings)
    return Forecast(arm, fit, fit.covariance, of_masses(arm, rings, fit)), rings


def changed(log, **columns):
    recording = log.recording
    return replace(log, recording=replace(recording, columns={**recording.columns, **columns}))


def test_every_motion_is_counted_once_and_a_stop_that_is_not_used_has_a_reason(logs):
    stops, payloads = stops_of(logs)
    assert len(stops) == 20
    assert [payload.mass for payload in payloads] == [0.0, 2.5, 4.5]
    assert all((stop.ringing is None) == bool(stop.reason) for stop in stops)
    assert sum(stop.ringing is not None for stop in stops) >= 12


def test_a_shaped_stop_is_not_used(logs):
    shaped = changed(logs[1], shaper_delay=np.full(len(logs[1].recording), 0.05))
    stops, _ = stops_of([shaped])
    assert {stop.reason for stop in stops} == {"the motion was shaped"}


def test_a_log_without_accelerometer_tells_nothing_and_says_so(logs):
    columns = dict(logs[1].recording.columns)
    del columns["actual_tool_accelerometer"]
    blind = replace(logs[1], recording=replace(logs[1].recording, columns=columns))
    with pytest.raises(IdentificationError, match=r"0 of 7 stops.*actual_tool_accelerometer.*Record"):
        agreeing(ROBOT, [blind], lambda _: None)


def test_a_stop_in_the_noise_is_not_used(logs):
    force = logs[1].recording["actual_tool_accelerometer"]
    rng = np.random.default_rng(0)
    stops, _ = stops_of(
        [changed(logs[1], actual_tool_accelerometer=force + rng.normal(0.0, 2.0, force.shape))]
    )
    assert {stop.reason for stop in stops} == {"the vibration does not stand out of the noise"}


def test_a_log_that_does_not_say_what_was_carried_is_refused_unless_it_is_given(logs):
    mute = replace(logs[1], recording=replace(logs[1].recording, info=None))
    with pytest.raises(RecordingError, match="give --payload MASS"):
        stops_of([mute])
    _, payloads = stops_of([replace(mute, payload=PAYLOADS[1])])
    assert payloads == PAYLOADS[1:]


def test_what_a_log_of_rtde_says_of_its_payload_holds_at_each_stop(logs):
    recording = logs[1].recording
    mass = np.where(np.arange(len(recording)) < len(recording) // 2, 1.0, 2.0)
    told = replace(changed(logs[1], payload=mass), payload=None)
    assert [payload.mass for payload in stops_of([told])[1]] == [1.0, 2.0]


@pytest.mark.nightly
def test_stops_with_another_payload_than_said_are_judged_out_and_no_others(logs):
    recording = asyncio.run(everyday_logs("ur5e", 21, 9))[2].recording
    third = int(recording["tick"][motions(recording)[2].start])
    wrong = Log("wrong", recording.between(0, third), PAYLOADS[0])
    stops, *_ = agreeing(ROBOT, [*logs, wrong], lambda _: None)
    assert [(s.log, s.motion) for s in stops if s.reason == CONTRADICTS] == [("wrong", 1), ("wrong", 2)]


def test_intervals_hold_the_true_modes_of_the_arm_that_was_fitted(forecast):
    known, _ = forecast
    arm, held = known.arm, []
    for q in free_configurations(ROBOT, PAYLOADS, 20, 9):
        f_d, zeta = describe(arm.drivetrain(arm.guess).poles(arm.mass(q, 1))[0][:2])
        there = known.at(q, 1, 2)
        held += [
            *(np.abs(np.log(there.f_d / f_d)) < SURE * there.f_d_error),
            *(np.abs(np.log(there.zeta / zeta)) < SURE * there.zeta_error),
        ]
    assert np.mean(held) >= 0.9


def test_proposals_are_jogs_that_no_body_is_in_the_way_of(forecast):
    known, rings = forecast
    found = more_jogs(known, rings[-1])
    assert len(found) == 3
    collisions, at = CollisionModel(ROBOT, body(PAYLOADS[1])), rings[-1].q
    for one in found:
        for after in (*one.way, one.q):
            assert all(
                collisions.meeting(at + share * (after - at)) is None for share in np.linspace(0.0, 1.0, 100)
            )
            at = after
        assert one.q - one.way[-1] == pytest.approx(jog_of(6))


def test_the_proposed_ring_downs_leave_less_of_what_is_uncertain(forecast):
    known, rings = forecast
    arm, more = known.arm, list(rings)
    rng = np.random.default_rng(5)
    for one in more_jogs(known, rings[-1]):
        ring = predicted(arm, one.q, rings[-1].payload)
        more.append(replace(ring, force=ring.force + rng.normal(0.0, ring.noise, ring.force.shape)))
    before, after = (np.linalg.slogdet(fit_modal(arm, some).covariance)[1] for some in (rings, more))
    assert after < before - 1.0


@pytest.mark.nightly
def test_where_nobody_has_listened_a_hidden_robot_rings_within_the_intervals_that_are_given(logs):
    found = calibrate(ROBOT, Measured(tuple(logs)), name="x", command="x", progress=lambda _: None)
    assert found.used + sum(unused(found.stops).values()) == 20
    assert "38 are needed" in found.no_polynomial
    held, sure = [], []
    for place in unseen(ROBOT, 21, 30, 0):
        known = found.forecast.at(place.q, found.forecast.arm.payloads.index(place.declared), 3)
        error = abs(np.log(known.f_d[0] / place.linear.f_d[0]))
        held.append(error < SURE * known.f_d_error[0])
        if known.f_d_percent[0] <= 5.0:
            sure.append(error)
    assert np.mean(held) >= 0.9
    assert len(sure) >= 10
    assert np.quantile(sure, 0.95) < 0.05
