"""Columns decoded in blocks are equal, to the last bit, to those made of one object for each message."""

import random
from pathlib import Path

import msgspec
import numpy as np
import pytest

from tvist_lab.recordings import mcap_file
from tvist_lab.recordings.mcap_file import RecordingFileError, read
from tvist_lab.recordings.messages import recording_of_messages
from tvist_protocol import Event, Info, Io, State, Truth
from tvist_protocol.generate import FOLDER
from tvist_protocol.recorded import topics
from tvist_server.recording.writer import RecordingWriter, heading

JOURNALS = sorted((Path(__file__).parents[1] / "journals").glob("*.mcap"))
FLOATS = [5e-324, -0.0, 0.1 + 0.2, 1e300, float("nan"), float("inf"), 2.0**53 + 2, 1e-310, 3.0]


def golden(name, kind):
    return msgspec.json.decode((FOLDER / "fixtures" / "v1" / f"{name}.json").read_bytes(), type=kind)


INFO, STATE, TRUTH, IO = (golden(kind.__name__.lower(), kind) for kind in (Info, State, Truth, Io))


def record(path, messages):
    with path.open("wb") as stream:
        writer = RecordingWriter(stream, topics(INFO.name), heading(INFO, {}))
        for message in messages:
            writer.write(message)
        writer.finish({})
    return path


def assert_equal(found, expected):
    assert list(found.columns) == list(expected.columns)
    for name, values in expected.columns.items():
        assert found[name].shape == values.shape, name
        assert found[name].tobytes() == values.tobytes(), name
    assert found.events == expected.events
    assert found.info == expected.info


def of_objects(content):
    return recording_of_messages(content.states, content.events, content.truths, content.info)


@pytest.fixture(params=[mcap_file.BLOCK, 7])
def block(request, monkeypatch):
    """With one block, and with many."""
    monkeypatch.setattr(mcap_file, "BLOCK", request.param)


@pytest.mark.parametrize("path", JOURNALS, ids=lambda path: path.stem)
@pytest.mark.usefixtures("block")
def test_the_columns_of_real_recordings(path):
    content = read(path)
    assert_equal(content.recording, of_objects(content))


def random_messages(seed):
    """States and truths with everything that messages may have: repeated, out of order, null, short, absent."""
    draw = random.Random(seed)

    def some(most=6):
        return [draw.choice(FLOATS) for _ in range(draw.choice([most, most, draw.randrange(most + 1)]))]

    ticks = [draw.randrange(40) for _ in range(60)]
    for tick in ticks:
        changes = {
            "tick": tick,
            "setpoint_sequence": draw.choice([None, 3]),
            "actual_q": some(),
            "estimated_f_d": some(2),
        }
        q = some()
        changes |= {
            "target_q": q,
            "unshaped_q": draw.choice([None, q[::-1]]),
            "motor_qd": draw.choice([None, some()]),
        }
        changes |= {"speed_scaling": draw.choice(FLOATS), "shaper_clipped": draw.random() < 0.5}
        yield msgspec.structs.replace(STATE, **changes)
        if draw.random() < 0.7:
            changes = {
                "tick": tick,
                "motor_q": some(),
                "static_link_deflection": [],
                "static_gear_deflection": some(),
            }
            yield msgspec.structs.replace(TRUTH, **changes)


@pytest.mark.parametrize("count", [5, pytest.param(200, marks=pytest.mark.nightly)])
@pytest.mark.usefixtures("block")
def test_the_columns_of_random_messages(count, tmp_path):
    for seed in range(count):
        content = read(record(tmp_path / "run.mcap", random_messages(seed)))
        assert content.complete
        assert_equal(content.recording, of_objects(content))


@pytest.mark.usefixtures("block")
def test_inputs_and_outputs_hold_until_the_next_message(tmp_path):
    ios = {
        tick: msgspec.structs.replace(
            IO,
            tick=tick,
            actual_digital_output_bits=bits,
            input_double_register=[0.0, value] + [0.0] * 46,
            output_int_register=[0] * 48,
        )
        for tick, bits, value in ((3, 0, 0.0), (5, 1, 0.0), (8, 2**17, 0.5))
    }
    messages = []
    for tick in (1, 2, 3, 4, 5, 7, 9):
        messages += [io for at, io in ios.items() if at <= tick and io not in messages]
        messages.append(msgspec.structs.replace(STATE, tick=tick))
    content = read(record(tmp_path / "run.mcap", messages))
    assert content.io == tuple(ios.values())
    bits = content.recording["actual_digital_output_bits"]
    assert np.array_equal(bits, [np.nan, np.nan, 0, 0, 1, 1, 2**17], equal_nan=True)
    assert content.recording["input_double_register"][2:, 1].tolist() == [0, 0, 0, 0, 0.5]
    assert "output_int_register" not in content.recording
    assert content.recording["tcp_offset"].shape == (7, 6)


@pytest.mark.usefixtures("block")
def test_a_field_that_an_earlier_version_did_not_write_has_its_default(tmp_path):
    from mcap.writer import Writer

    with (tmp_path / "run.mcap").open("wb") as stream:
        writer = Writer(stream)
        writer.start()
        channel = writer.register_channel("tvist/ur5e/state", "json", 0)
        for tick in range(10):
            content = msgspec.to_builtins(msgspec.structs.replace(STATE, tick=tick))
            if tick < 9:
                del content["shaper_clipped"], content["motor_limited"]
            else:
                content |= {"shaper_clipped": True, "of_a_later_version": {"a": [1]}}
            writer.add_message(channel, tick, msgspec.json.encode(content), tick)
        writer.finish()
    content = read(tmp_path / "run.mcap")
    assert content.complete
    assert content.recording["shaper_clipped"].tolist() == [0.0] * 9 + [1.0]
    assert_equal(content.recording, of_objects(content))


@pytest.mark.usefixtures("block")
def test_events_before_an_invalid_state_are_kept_and_later_ones_are_not(tmp_path):
    from mcap.writer import Writer

    from tvist_protocol.recorded import to_json

    with (tmp_path / "run.mcap").open("wb") as stream:
        writer = Writer(stream)
        writer.start()
        states = writer.register_channel("tvist/ur5e/state", "json", 0)
        events = writer.register_channel("tvist/ur5e/event", "json", 0)
        for tick in range(20):
            state = to_json(msgspec.structs.replace(STATE, tick=tick))
            writer.add_message(
                states, tick, state if tick != 12 else state.replace(b'"tick":12', b'"tick":"a"'), tick
            )
            writer.add_message(events, tick, to_json(Event(tick=tick, kind="warning")), tick)
        writer.finish()
    content = read(tmp_path / "run.mcap")
    assert len(content.recording) == len(content.events) == len(content.states) == 12
    assert "contains an invalid message" in content.note


def test_a_file_that_is_gone_or_shorter_when_its_states_are_asked_for_is_said(tmp_path):
    path = record(tmp_path / "run.mcap", random_messages(0))
    content = read(path)
    path.write_bytes(path.read_bytes()[:1500])
    with pytest.raises(RecordingFileError, match="has changed since it was read"):
        _ = content.states
    path.unlink()
    with pytest.raises(RecordingFileError, match="No such file"):
        _ = content.truths


def test_states_added_while_it_is_read_do_not_appear(tmp_path):
    messages = [msgspec.structs.replace(STATE, tick=tick) for tick in range(500)]
    path = record(tmp_path / "run.mcap", messages[:300])
    content = read(path)
    record(path, messages)
    assert len(content.states) == len(content.recording) == 300
    assert np.array_equal(content.recording["tick"], [state.tick for state in content.states])
