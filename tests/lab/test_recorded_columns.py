"""Columns decoded in blocks are equal, to the last bit, to those made of one object for each message."""

import random
from pathlib import Path

import msgspec
import numpy as np
import pytest
from tests.lab.golden import HARD_FLOATS, IO, STATE, TRUTH, changed, foreign, record

from tvist_lab.recordings import mcap_file
from tvist_lab.recordings.mcap_file import RecordingFileError, read
from tvist_lab.recordings.messages import recording_of_messages
from tvist_protocol import Event, Io

JOURNALS = Path(__file__).parents[1] / "journals"
FLOATS = [*HARD_FLOATS, float("nan"), float("inf"), 1e-310]


def equals_objects(content):
    found = content.recording
    expected = recording_of_messages(content.states, content.events, content.truths, content.info)
    assert list(found.columns) == list(expected.columns)
    for name, values in expected.columns.items():
        assert (found[name].shape, found[name].tobytes()) == (values.shape, values.tobytes()), name
    return (found.events, found.info) == (expected.events, expected.info)


@pytest.fixture(params=[mcap_file.BLOCK, 7], autouse=True)
def _block(request, monkeypatch):
    """With one block, and with many."""
    monkeypatch.setattr(mcap_file, "BLOCK", request.param)


@pytest.mark.parametrize("name", ["faults", "live_lost_lease"])
def test_columns_of_recordings_equal_their_decoded_messages(name):
    assert equals_objects(read(JOURNALS / f"{name}.mcap"))


def random_messages(seed):
    """States and truths with everything that messages may have: repeated, out of order, null, short, absent."""
    draw = random.Random(seed)

    def some(most=6):
        return [draw.choice(FLOATS) for _ in range(draw.choice([most, most, draw.randrange(most + 1)]))]

    for tick in [draw.randrange(40) for _ in range(60)]:
        q = some()
        yield changed(
            STATE, tick=tick, setpoint_sequence=draw.choice([None, 3]), actual_q=some(), estimated_f_d=some(2),
            target_q=q, unshaped_q=draw.choice([None, q[::-1]]), motor_qd=draw.choice([None, some()]),
            speed_scaling=draw.choice(FLOATS), shaper_clipped=draw.random() < 0.5,
        )  # fmt: skip
        if draw.random() < 0.7:
            short = {"static_link_deflection": [], "static_gear_deflection": some()}
            yield changed(TRUTH, tick=tick, motor_q=some(), **short)


def test_columns_of_random_messages(tmp_path):
    for seed in range(5):
        content = read(record(tmp_path / "run.mcap", random_messages(seed)))
        assert content.complete
        assert equals_objects(content)


def test_inputs_and_outputs_hold_until_the_next_message(tmp_path):
    ios = [
        changed(
            IO, tick=tick, actual_digital_output_bits=bits, output_int_register=[0] * 48,
            input_double_register=[0.0, value] + [0.0] * 46,
        )
        for tick, bits, value in ((3, 0, 0.0), (5, 1, 0.0), (8, 2**17, 0.5))
    ]  # fmt: skip
    messages = []
    for tick in (1, 2, 3, 4, 5, 7, 9):
        messages += [io for io in ios if io.tick <= tick and io not in messages]
        messages.append(changed(STATE, tick=tick))
    content = read(record(tmp_path / "run.mcap", messages))
    assert list(content.again(Io)) == ios
    bits = content.recording["actual_digital_output_bits"]
    assert np.array_equal(bits, [np.nan, np.nan, 0, 0, 1, 1, 2**17], equal_nan=True)
    assert content.recording["input_double_register"][2:, 1].tolist() == [0, 0, 0, 0, 0.5]
    assert "output_int_register" not in content.recording
    assert content.recording["tcp_offset"].shape == (7, 6)


def written(path, states):
    """A file of another program, with an event for each state."""
    messages = []
    for tick, state in enumerate(states):
        messages += [("tvist/ur5e/state", state), ("tvist/ur5e/event", Event(tick=tick, kind="warning"))]
    return read(foreign(path, [(topic, msgspec.json.encode(message)) for topic, message in messages]))


def test_field_missing_in_an_earlier_version_has_its_default(tmp_path):
    states = [msgspec.to_builtins(changed(STATE, tick=tick)) for tick in range(10)]
    for state in states[:9]:
        del state["shaper_clipped"], state["motor_limited"]
    states[9] |= {"shaper_clipped": True, "of_a_later_version": {"a": [1]}}
    content = written(tmp_path / "run.mcap", states)
    assert content.complete
    assert content.recording["shaper_clipped"].tolist() == [0.0] * 9 + [1.0]
    assert equals_objects(content)


def test_events_before_an_invalid_state_are_kept(tmp_path):
    states = [msgspec.to_builtins(changed(STATE, tick=tick)) for tick in range(20)]
    states[12]["tick"] = "a"
    content = written(tmp_path / "run.mcap", states)
    assert len(content.recording) == len(content.events) == len(content.states) == 12
    assert "contains an invalid message" in content.note


def test_file_that_changed_since_it_was_read_is_refused(tmp_path):
    path = record(tmp_path / "run.mcap", random_messages(0))
    content = read(path)
    path.write_bytes(path.read_bytes()[:1500])
    with pytest.raises(RecordingFileError, match="has changed since it was read"):
        _ = content.states
    path.unlink()
    with pytest.raises(RecordingFileError, match="No such file"):
        _ = content.truths


def test_states_appended_during_reading_are_ignored(tmp_path):
    messages = [changed(STATE, tick=tick) for tick in range(500)]
    path = record(tmp_path / "run.mcap", messages[:300])
    content = read(path)
    record(path, messages)
    assert len(content.states) == len(content.recording) == 300
    assert np.array_equal(content.recording["tick"], [state.tick for state in content.states])
