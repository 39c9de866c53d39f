"""A cell with a gripper: boxes are picked and placed by URScript and by ur_rtde, whose recording replays equally."""

from pathlib import Path

import pytest
from tests.conformance.served import Served, finished
from tests.places import own_address

from tvist_lab.recordings.mcap_file import read

from .test_ur_lockstep import replayed

EXAMPLES = Path(__file__).parents[2] / "clients" / "examples"
CELL, PROGRAM = EXAMPLES / "cell.toml", EXAMPLES / "pick_and_place.script"
BOXES = [f"cell: the gripper holds box {number} ({0.4 * number:g} kg)" for number in (1, 2, 3, 4)]


def told(content):
    """Return the messages of picking, how many boxes were put down, and the warnings about payloads."""
    texts = [event.why for event in content.events if event.kind == "text"]
    picked, put = ([text for text in texts if word in text] for word in ("holds", "lies at p[-0.6"))
    return picked, len(put), [event.why for event in content.events if event.code == "payload_mismatch"]


def test_program_moves_a_box_with_its_payload_declared(called, tmp_path):
    """All boxes take the robot 40 s."""
    path, program = tmp_path / "run.mcap", tmp_path / "one_box.script"
    program.write_text(PROGRAM.read_text().replace("n < 4", "n < 1"))
    ended = called("run", program, "--cell", CELL, "--lockstep", "--record", path).assert_done()
    assert told(read(path)) == (BOXES[:1], 1, [])
    assert "made 6 moves; after a stop the tool shook with at most" in ended.err


@pytest.mark.realtime
@pytest.mark.nightly
def test_ur_rtde_with_a_socket_to_the_gripper_moves_all_boxes(tmp_path):
    pytest.importorskip("rtde_control")
    host, path = own_address(57), tmp_path / "run.mcap"
    with Served("--ur", "--ur-address", host, "--cell", str(CELL), "--record", str(path)) as served:
        ended = finished(EXAMPLES / "04_ur_rtde_gripper.py", host)
        assert ended.returncode == 0, ended.stderr
        assert "4 of 4 boxes were gripped" in ended.stdout
        assert served.end() == 0
    content = replayed(path)
    assert told(content) == (BOXES, 4, [])
    assert sum(entry.kind == "gripper" for entry in content.journal) == 2 + 2 * 4
