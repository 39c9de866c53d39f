"""Tracking of `servoj`: what is wanted, how late the arm is, and what a path tolerance allows."""

from dataclasses import replace

import numpy as np
import pytest
from tests.search.subject import RigidArm

from tvist_lab.studies.tracking.following import BEFORE, LOOKAHEAD, TrackingError, follow
from tvist_lab.studies.tracking.study import (
    UNSHAPED,
    TrackingJob,
    columns,
    compare,
    page_of,
    refusal,
    report,
    speed_at,
    track,
    within,
)
from tvist_lab.studies.tracking.ways import CONSTANT, RAMP, WAYS, jump, level_end, ramp, turn
from tvist_lab.study.tables import cells, titles
from tvist_plant.description import Payload
from tvist_plant.plant import PERIOD

START = np.array([-1.60, -1.727, -2.203, -0.808, 1.595, -0.031])
LAG = LOOKAHEAD + 2 * PERIOD
"""Lag of `servoj`, as measured on a UR10e at this lookahead: 17 steps."""


def ramp_of(shaper, speed=1.0):
    return track(TrackingJob(shaper, 0.0, "ramp", speed))


def tracked(error, speed=1.0, shaper=UNSHAPED, way="ramp"):
    row = {"shaper": shaper, "way": way, "speed_rad_s": speed, "error_rad": error}
    return row | {"lag_ms": 1e3 * LAG, "mean_delay_ms": 0.0} if way == "ramp" else row


@pytest.fixture(scope="module")
def unshaped():
    return ramp_of(UNSHAPED)


class TestWays:
    @pytest.mark.parametrize("speed", [0.5, 2.0, 3.0])
    def test_a_ramp_has_its_speed_and_acceleration_and_moves_one_joint(self, speed):
        q = ramp(START, speed)
        qd, qdd = np.diff(q, axis=0) / PERIOD, np.diff(q, 2, axis=0) / PERIOD**2
        assert np.abs(qd).max() == pytest.approx(speed)
        assert np.abs(qdd).max() <= RAMP + 1e-6
        assert (q[:, 1:] == START[1:]).all()
        assert q[-1, 0] - q[0, 0] == pytest.approx(speed * (CONSTANT + speed / RAMP))
        end = level_end(speed)
        assert qd[end - 1, 0] == pytest.approx(speed)
        assert qd[end + 1, 0] < speed - 1e-3

    def test_a_turn_is_the_same_for_all_joints_from_wherever_they_are(self):
        q = turn(START, 2.0)
        assert q[0] == pytest.approx(START)
        assert q[125] == pytest.approx(START + 0.5)
        assert q[-1] == pytest.approx(START + 1.0)
        assert np.flatnonzero(np.diff(q[:, 0]))[-1] == 249

    def test_the_jump_is_the_drivers_test(self):
        q = jump(START, 2.0)
        at = {seconds: q[round(seconds / PERIOD)] for seconds in (0.0, 3.0, 6.0, 6.25, 6.5)}
        assert at[0.0] == pytest.approx(START)
        assert at[3.0] == pytest.approx(0.5 * START)
        assert at[6.0] == pytest.approx(np.zeros(6))
        assert at[6.25] == pytest.approx(np.full(6, -0.5))
        assert at[6.5] == pytest.approx(np.full(6, -1.0))
        assert (q[-1] == at[6.5]).all()


class TestLag:
    def test_without_a_shaper_it_is_that_of_servoj(self, unshaped):
        assert unshaped["lag_ms"] == pytest.approx(1e3 * LAG, abs=0.2)
        assert unshaped["mean_delay_ms"] == 0.0

    def test_the_error_is_lag_times_speed(self, unshaped):
        assert unshaped["error_rad"] == pytest.approx(LAG, rel=0.01)
        assert ramp_of(UNSHAPED, 2.0)["error_rad"] == pytest.approx(2.0 * LAG, rel=0.01)

    @pytest.mark.parametrize("shaper", ["zv", "zvd", "auto"])
    def test_a_shaper_adds_its_mean_delay(self, unshaped, shaper):
        found = ramp_of(shaper)
        assert found["mean_delay_ms"] > 10.0
        assert found["lag_ms"] - unshaped["lag_ms"] == pytest.approx(found["mean_delay_ms"], abs=0.2)
        assert found["error_rad"] > unshaped["error_rad"]

    def test_without_shape_servo_every_shaper_is_bypassed(self):
        wanted = ramp(START, 1.0)
        plain = TrackingJob(UNSHAPED, 0.0, "ramp", 1.0).setup()
        other = follow(replace(plain, shaper="auto"), wanted)
        assert other.mean_delay == 0.0
        assert np.array_equal(other.actual, follow(plain, wanted).actual)

    def test_an_arm_that_is_always_at_its_target_is_late_by_the_lag_to_the_tick(self):
        """Without the arm, what is left is the model of `servoj`: wanted positions of 17 ticks ago."""
        setup = replace(TrackingJob(UNSHAPED, 0.0, "ramp", 1.0).setup(), compensate_sag=False)
        wanted = ramp(START, 1.0)
        actual = follow(setup, wanted, RigidArm(Payload())).actual
        end = level_end(1.0)
        assert actual[end] == pytest.approx(wanted[end - round(LAG / PERIOD)], abs=1e-5)


class TestDriversTest:
    def test_from_the_start_posture_its_motion_is_inside_its_tolerance(self):
        found = track(TrackingJob(UNSHAPED, 0.0, "turn", 2.0))
        assert found["error_rad"] > 2.0 * LAG
        assert within(found, 0.2)

    def test_the_stretched_arm_falls_further_behind_than_the_lag(self):
        found = track(TrackingJob(UNSHAPED, 0.0, "jump", 2.0))
        assert "lag_ms" not in found
        assert found["error_rad"] > 3.0 * LAG * 2.0
        assert not within(found, 0.2)

    def test_a_robot_that_stops_is_reported(self):
        setup = TrackingJob(UNSHAPED, 0.0, "ramp", 1.0).setup()
        wanted = np.tile(setup.q, (200, 1))
        wanted[:, 2] = np.linspace(
            wanted[0, 2], -20.0, 200
        )  # into the arm itself, or beyond the joint's range
        with pytest.raises(TrackingError):
            follow(setup, wanted)


class TestTolerance:
    def test_an_error_equal_to_it_is_within(self):
        assert within(tracked(0.2), 0.2)
        assert not within(tracked(0.2 + 1e-12), 0.2)

    def test_the_speed_at_which_it_is_used_up_is_interpolated(self):
        group = [tracked(0.1, 1.0), tracked(0.3, 2.0), tracked(0.5, 3.0)]
        assert speed_at(0.2, group) == pytest.approx(1.5)
        assert speed_at(0.05, group) == pytest.approx(0.5)
        assert speed_at(0.1, group) == pytest.approx(1.0)
        assert speed_at(0.5, group) is None


class TestReport:
    def test_results_do_not_depend_on_the_order_of_the_shapers(self):
        names = [UNSHAPED, "zv", "mzv"]
        one, other = (
            {
                made["shaper"]: made
                for made in compare([TrackingJob(name, 1.0, "ramp", 0.5) for name in order])
            }
            for order in (names, names[::-1])
        )
        assert one == other
        assert set(one) == set(names)

    def test_a_shaper_that_the_robot_refuses_has_its_reason(self):
        assert "um_zv" in refusal("um_zv", 0.0)
        assert "zzz" in refusal("zzz", 0.0)
        assert refusal("zv", 5.0) is None

    def test_errors_beyond_the_tolerance_stand_out_and_the_page_names_its_command(self):
        made = [
            tracked(error * speed, speed, shaper, way)
            for shaper, error in ((UNSHAPED, 0.05), ("zv", 0.12))
            for way in WAYS
            for speed in (1.0, 2.0)
        ]
        result = {
            "command": "tvist study tracking --shapers zv --speeds 1 2", "payload_kg": 0.0, "tolerance_rad": 0.2,
            "speeds_rad_s": [1.0, 2.0], "lookahead_s": 0.03, "gain": 2000.0, "step_s": PERIOD,
            "refused": {"um_zv": "zeta_max is too large"}, "shapers": report(made, 0.2),
        }  # fmt: skip
        assert cells(result["shapers"], columns(result, "jump", "*")) == [
            ("not shaped", "0.050", "0.100", "> 2 rad/s"),
            ("zv", "0.120", "*0.240*", "1.67 rad/s"),
        ]
        ramps = columns(result, "ramp", "**")
        assert titles(ramps) == ("shaper", "mean delay ms", "lag ms", "1 rad/s", "2 rad/s", "0.2 rad at")
        assert cells(result["shapers"], ramps)[1] == ("zv", "0.0", "34.0", "0.120", "**0.240**", "1.67 rad/s")
        text = page_of(result)
        assert "tvist study tracking --shapers zv --speeds 1 2" in text
        assert "`um_zv`: zeta_max is too large" in text


def test_the_first_position_is_where_the_arm_rests():
    """Nothing moves before the trajectory does, so the ticks before it do not change the result."""
    setup = TrackingJob(UNSHAPED, 0.0, "ramp", 1.0).setup()
    still = follow(setup, np.tile(setup.q, (BEFORE, 1)))
    assert np.abs(still.actual - setup.q).max() < 1e-4
