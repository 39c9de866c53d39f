"""Recording: messages become columns."""

import numpy as np
import pytest

from tvist_lab.recordings import Recording, RecordingError
from tvist_lab.recordings.messages import recording_of_messages
from tvist_protocol.stream import Event, State, Truth

ARRAYS = ("reference_q", "target_q", "target_qd", "target_qdd", "target_moment", "actual_q", "actual_qd")


def state(tick, **fields):
    values = {name: [0.1 * tick] * 2 for name in (*ARRAYS, "actual_moment")}
    values |= {
        "actual_TCP_pose": [0.0] * 6, "actual_TCP_speed": [0.0] * 6, "actual_tool_accelerometer": [0.0] * 3,
        "estimated_f_d": [6.7], "estimated_zeta": [0.34], "robot_mode": 7, "safety_mode": 1, "runtime_state": 1,
        "speed_scaling": 1.0, "shaper_delay": 0.07, "missed_ticks": 0, "setpoint_sequence": None,
    }  # fmt: skip
    return State(**{**values, "tick": tick, "timestamp": 0.002 * tick, **fields})


def truth(tick):
    lists = ("motor_q", "motor_qd", "gear_deflection", "link_deflection", "flange_pose", "f_d", "zeta")
    values = {name: [0.0] for name in (*lists, "participation")}
    return Truth(**values, tick=tick, timestamp=0.002 * tick, tool_acceleration=[1.0, 2.0, 9.81])


def test_every_field_of_a_state_is_a_column_of_its_name():
    recording = recording_of_messages([state(3), state(4)])
    assert set(recording.columns) == set(State.__struct_fields__)
    assert recording["reference_q"].shape == (2, 2)
    assert recording["timestamp"].tolist() == [0.006, 0.008]


def test_states_are_put_in_order_and_one_that_came_twice_counts_once():
    recording = recording_of_messages([state(5), state(4), state(5), state(6)])
    assert recording["tick"].tolist() == [4, 5, 6]
    assert len(recording) == 3


def test_joints_and_period_come_from_the_data_even_where_ticks_are_missing():
    recording = recording_of_messages([state(10), state(11), state(15)])
    assert recording.joints == 2
    assert recording.period == pytest.approx(0.002)
    assert recording.missing_ticks == 3


def test_null_and_lists_of_changing_length_become_nan():
    recording = recording_of_messages(
        [state(0), state(1, setpoint_sequence=8, estimated_f_d=[6.7, 9.0]), state(2, estimated_f_d=[])]
    )
    np.testing.assert_array_equal(recording["setpoint_sequence"], [np.nan, 8.0, np.nan])
    np.testing.assert_array_equal(recording["estimated_f_d"], [[6.7, np.nan], [6.7, 9.0], [np.nan, np.nan]])


def test_a_shaper_without_modes_leaves_an_empty_column():
    recording = recording_of_messages([state(0, estimated_f_d=[]), state(1, estimated_f_d=[])])
    assert recording["estimated_f_d"].shape == (2, 0)


def test_truth_is_aligned_by_tick_and_nan_where_it_is_missing():
    recording = recording_of_messages([state(1), state(2)], truths=[truth(2), truth(7)])
    column = recording["truth_tool_acceleration"]
    assert np.isnan(column[0]).all()
    assert column[1].tolist() == [1.0, 2.0, 9.81]
    assert "truth_flange_pose" in recording
    assert "truth_tick" not in recording


def test_a_slice_keeps_rows_and_events_of_its_ticks_both_ends_included():
    events = [Event(tick=tick, kind="warning") for tick in (9, 2, 4, 5)]
    part = recording_of_messages([state(tick) for tick in range(10)], events, info="info").between(2, 4)
    assert part["tick"].tolist() == [2, 3, 4]
    assert [event.tick for event in part.events] == [2, 4]
    assert part.info == "info"


def test_a_slice_without_states_is_refused():
    with pytest.raises(RecordingError, match="no state between ticks 5 and 9"):
        recording_of_messages([state(1)]).between(5, 9)


def test_a_missing_column_is_named_with_those_there_are():
    recording = recording_of_messages([state(1)])
    with pytest.raises(RecordingError, match=r"no column colour; it has .*reference_q"):
        recording["colour"]
    with pytest.raises(RecordingError, match="was truth recorded"):
        recording["truth_tool_acceleration"]


def test_no_states_columns_that_do_not_fit_and_ticks_that_stand_still_are_refused():
    with pytest.raises(RecordingError, match="at least one state"):
        recording_of_messages([])
    with pytest.raises(RecordingError, match="needs the column tick"):
        Recording({})
    with pytest.raises(RecordingError, match="column timestamp has 1 rows, column tick 2"):
        Recording({"tick": np.arange(2.0), "timestamp": np.zeros(1)})
    with pytest.raises(RecordingError, match="must increase"):
        Recording({"tick": np.zeros(2)})
    with pytest.raises(RecordingError, match="two states"):
        _ = recording_of_messages([state(1)]).period


def test_the_columns_of_a_recording_cannot_be_exchanged():
    with pytest.raises(TypeError):
        recording_of_messages([state(1)]).columns["tick"] = np.zeros(1)
