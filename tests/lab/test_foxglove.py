"""An export for Foxglove draws the arm where it was, and keeps all messages of the recording."""

import json
from pathlib import Path

import jsonschema
import numpy as np
import pytest
from mcap.reader import make_reader
from scipy.spatial.transform import Rotation
from tests.lab.golden import record

from tvist_cli.commands.log.export import export as export_command
from tvist_controller.about import info_of
from tvist_controller.controller import Controller
from tvist_lab.foxglove.export import export
from tvist_lab.in_process import free_setup
from tvist_lab.recordings import RecordingError
from tvist_lab.recordings.export import written_by
from tvist_lab.recordings.mcap_file import read
from tvist_protocol import MoveJ, TakeControl
from tvist_protocol.replies import Accepted

SEVEN = Path(__file__).parents[1] / "plant" / "urdf" / "seven.urdf"
TICKS = 240


def recorded(path, *, robot="ur5e", truth=True, start=True):
    """A short motion, recorded as by a server, or as by a client without its start."""
    own = {"calibration": "none", "shaper": "none"} if robot == SEVEN else {}
    setup = free_setup(robot=str(robot), truth=truth, **own)
    controller, told = Controller(setup), []
    info = info_of(controller)
    token = controller.receive(TakeControl(client="test", lease_s=30.0)).token
    there = [angle + 0.2 for angle in setup.q]
    assert isinstance(controller.receive(MoveJ(token=token, q=there)), Accepted)
    for _ in range(TICKS):
        state, events = controller.tick()
        told += [*events, state, *([controller.truth()] if truth else [])]
    return record(path, told, info=info, start=setup.to_builtins() if start else {})


def messages(path):
    """Schema, topic, time and content of each message, as a reader that is not ours finds them."""
    with path.open("rb") as stream:
        return [
            (json.loads(schema.data), channel.topic, message.log_time, json.loads(message.data))
            for schema, channel, message in make_reader(stream, validate_crcs=True).iter_messages()
        ]


def pose(step):
    out = np.eye(4)
    out[:3, 3] = [step["translation"][axis] for axis in "xyz"]
    out[:3, :3] = Rotation.from_quat([step["rotation"][axis] for axis in "xyzw"]).as_matrix()
    return out


def flanges(path):
    """Time and pose of the flange, from the chain of frames."""
    for _, topic, time, content in messages(path):
        if topic.endswith("/frames"):
            at, frame = np.eye(4), "world"
            for step in content["transforms"]:
                assert step["parent_frame_id"] == frame
                at, frame = at @ pose(step), step["child_frame_id"]
            assert frame == "flange"
            yield time, at


@pytest.mark.parametrize(("robot", "truth"), [("ur5e", True), ("one-joint", False), (SEVEN, True)])
def test_frames_end_at_the_flange(robot, truth, tmp_path):
    run, path = recorded(tmp_path / "run.mcap", robot=robot, truth=truth), tmp_path / "out.mcap"
    notes = export(read(run), path)
    assert any("no truth" in note for note in notes) != truth
    kind, field = ("/truth", "flange_pose") if truth else ("/state", "actual_TCP_pose")
    true = {time: content[field] for _, topic, time, content in messages(run) if topic.endswith(kind)}
    found = list(flanges(path))
    assert len(found) == TICKS // 10 + 1
    for time, at in found:
        assert at[:3, 3] == pytest.approx(true[time][:3], abs=1e-6)
        turned = Rotation.from_matrix(at[:3, :3]).inv() * Rotation.from_rotvec(true[time][3:])
        assert turned.magnitude() < 1e-6


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    return recorded(tmp_path_factory.mktemp("run") / "run.mcap")


def test_second_export_keeps_all_other_messages(run, tmp_path):
    once, twice = tmp_path / "once.mcap", tmp_path / "twice.mcap"
    assert export(read(run), once) == export(read(once), twice) == []
    first, again = read(run), read(twice)
    assert (first.states, first.truths, first.events) == (again.states, again.truths, again.events)
    assert (first.start, first.info, first.complete) == (again.start, again.info, again.complete)
    assert once.read_bytes() == twice.read_bytes()
    assert once.stat().st_size < 1.15 * run.stat().st_size


def test_messages_match_schemas_and_layout_matches_topics(run, tmp_path):
    path, beside = written_by(tmp_path / "out.mcap", "foxglove")
    export(read(run), path)
    found = messages(path)
    assert [topic.rsplit("/")[-1] for _, topic, _, _ in found[:2]] == ["arm", "frames"]  # shown at once
    last = {}
    for schema, topic, _, content in found:
        if schema["title"].startswith("foxglove.") or topic.endswith("/curves"):
            jsonschema.validate(content, schema)
        last[topic] = content
    frames = {step["child_frame_id"] for step in last["tvist/ur5e/frames"]["transforms"]} | {"world"}
    bodies = last["tvist/ur5e/arm"]["entities"]
    assert all(body["frame_id"] in frames and body["frame_locked"] and body["spheres"] for body in bodies)
    panels = json.loads(beside.read_text())["configById"].values()
    paths = [path["value"].split(".") for panel in panels for path in panel.get("paths", ())]
    assert len(paths) == 6
    assert all(field in last[topic] for topic, field in paths)
    assert all(topic in last for panel in panels for topic in panel.get("topics", ()))


def test_recording_of_a_client_is_refused(tmp_path):
    client = recorded(tmp_path / "client.mcap", start=False)
    with pytest.raises(RecordingError, match="does not describe its robot: record it with"):
        export(read(client), tmp_path / "out.mcap")


def test_truncated_file_is_exported_up_to_the_damage(run, tmp_path, capsys):
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(run.read_bytes()[:-40_000])
    export_command(cut, to="foxglove")
    assert "was not closed; it could be read up to tick" in capsys.readouterr().err
    assert read(tmp_path / "cut.foxglove.mcap").counts == read(cut).counts
