"""Table 2 has the paper's columns, and says what could not be measured."""

import json

import numpy as np
import pytest

from tvist_lab.metrics import MotionResult, Runs, analyze, table_2, table_notes

COLUMNS = {"delay_ms", "stabilisation_ms", "cycle_ms", "overshoot_m", "residual_vibration_m_s2"}
IMPACTS = {"stabilisation", "cycle", "overshoot", "residual_vibration"}
TICKS = 1500


def result(**values):
    columns = {
        "start_s": 0.2,
        "stop_s": 2.0,
        "delay_ms": 0.0,
        "stabilisation_ms": 500.0,
        "cycle_ms": 2300.0,
        "overshoot_m": 5e-4,
        "residual_vibration_m_s2": 1.0,
    }
    return MotionResult(**{**columns, **values})


def test_the_table_is_nested_and_named_as_the_papers():
    table = table_2({"Q1-Q2": Runs([result()], [result(delay_ms=74.0)])})
    assert set(table) == {"Q1-Q2"}
    assert set(table["Q1-Q2"]) == {"unshaped", "shaped", "impact_percent"}
    assert set(table["Q1-Q2"]["unshaped"]) == set(table["Q1-Q2"]["shaped"]) == COLUMNS
    assert set(table["Q1-Q2"]["impact_percent"]) == IMPACTS
    json.dumps(table, allow_nan=False)


def test_an_impact_is_the_change_of_the_means_in_percent_as_the_paper_signs_it():
    runs = Runs(
        [result(residual_vibration_m_s2=1.0), result(residual_vibration_m_s2=1.22)],
        [result(residual_vibration_m_s2=0.10), result(residual_vibration_m_s2=0.16)],
    )
    row = table_2({"Q1-Q2": runs})["Q1-Q2"]
    assert row["unshaped"]["residual_vibration_m_s2"] == pytest.approx(1.11)
    assert row["shaped"]["residual_vibration_m_s2"] == pytest.approx(0.13)
    assert row["impact_percent"]["residual_vibration"] == pytest.approx(-88.3, abs=0.05)
    assert row["impact_percent"]["cycle"] == 0.0


def test_runs_that_could_not_be_measured_are_left_out_of_a_mean_and_noted():
    silent = result(overshoot_m=None, notes={"overshoot_m": "the tool had not settled"})
    runs = {"Q1-Q2": Runs([result(), silent, result(overshoot_m=1e-4)], [silent])}
    row = table_2(runs)["Q1-Q2"]
    assert row["unshaped"]["overshoot_m"] == pytest.approx(3e-4)
    assert row["shaped"]["overshoot_m"] is None
    assert row["impact_percent"]["overshoot"] is None
    assert table_notes(runs) == [
        "Q1-Q2 unshaped overshoot_m: the tool had not settled (1 of 3 runs)",
        "Q1-Q2 shaped overshoot_m: the tool had not settled (1 of 1 runs)",
    ]


def test_there_is_no_impact_on_what_was_nothing_before():
    row = table_2({"Q1-Q3": Runs([result(overshoot_m=0.0)], [result(overshoot_m=0.0)])})["Q1-Q3"]
    assert row["unshaped"]["overshoot_m"] == 0.0
    assert row["impact_percent"]["overshoot"] is None


def test_a_recording_is_measured_motion_by_motion(one_motion, ring):
    noise = 0.03 * np.random.default_rng(0).standard_normal((TICKS, 3))
    alpha = ring(TICKS, 538, 10.0, 0.1, 1.0, axis=(0.0, 1.0, 1.0))
    position = np.zeros((TICKS, 3))
    position[:, 0] = np.interp(np.arange(TICKS), [100, 560, 580, 620], [0.5, 0.0, 1e-4, 0.0])
    (measured,) = analyze(one_motion(37, alpha=alpha + noise, truth=alpha, position=position))
    assert measured.start_s == pytest.approx(0.2)
    assert measured.stop_s == pytest.approx(2 * 0.538)
    assert measured.delay_ms == pytest.approx(74.0)
    assert measured.overshoot_m == pytest.approx(1e-4)
    assert measured.residual_vibration_m_s2 == pytest.approx(1.0, rel=0.15)
    assert measured.f_d_hz == pytest.approx(10.0, rel=0.02)
    assert measured.zeta == pytest.approx(0.1, rel=0.1)
    assert measured.still_after_ms == pytest.approx(1e3 * (0.876 + np.log(10.0) / 6.31), abs=60.0)
    assert set(measured.notes) <= {"servo_lag_ms"}  # the made-up arm does not follow


def test_what_is_not_measurable_is_null_with_the_reason_under_its_name(one_motion):
    (measured,) = analyze(one_motion(ticks=560))
    plain = json.loads(json.dumps(measured.as_dict(), allow_nan=False))
    missing = {"stabilisation_ms", "cycle_ms", "overshoot_m", "residual_vibration_m_s2", "f_d_hz", "zeta"}
    missing |= {"f_d_interval_hz", "zeta_interval", "servo_lag_ms"}
    assert {name for name, value in plain.items() if value is None} == missing
    assert set(plain["notes"]) == missing
    assert "0.2 s" in plain["notes"]["f_d_hz"]


def test_an_rv_that_is_no_fitted_decay_and_a_motion_cut_short_are_noted(one_motion, event):
    events = [event(101, "motion_started", 1), event(501, "motion_stopped", 1)]
    (measured,) = analyze(one_motion(events=events))
    assert measured.residual_vibration_m_s2 is not None
    assert "fewer than two peaks" in measured.notes["residual_vibration_m_s2"]
    assert "stopped" in measured.notes["stop_s"]
