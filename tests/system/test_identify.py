"""`tvist identify`: jogs in process and over a network, logs, twins, payloads; and where it cannot be done."""

import json
from pathlib import Path

import pytest
from tests.conformance.served import Served
from tests.system.test_command_line import tvist

from tvist_plant.description import fingerprint, load
from tvist_protocol.calibration import calibration_from_json

KEYS = {"configurations", "ring_downs", "error_f_d_percent", "error_zeta_percent"}


def test_too_few_measurements_are_a_sentence_and_no_file(tmp_path):
    ended = tvist("identify", "--ring-downs", "3", "--output", tmp_path / "never.json", "--json")
    assert ended.assert_failed(1, "at least 4").out == ""
    assert list(tmp_path.iterdir()) == []


def test_a_few_ring_downs_make_a_calibration(tmp_path):
    path = tmp_path / "mine.json"
    options = ("--ring-downs", 5, "--output", path, "--json")
    said = tvist("identify", *options).assert_done().json
    assert said.keys() >= KEYS
    assert said["ring_downs"] == 5
    assert said["payloads_kg"] == [0.0, 5.0]
    assert said["error_f_d_percent"] < 6.0
    calibration = calibration_from_json(path.read_bytes())
    assert calibration.name == "mine"
    assert [mode["measured_at_m_s2"] > 0.1 for mode in said["modes"]] == [True] * 3
    assert calibration.provenance.command.startswith("tvist identify --ring-downs 5 --output")
    assert calibration.provenance.arm == fingerprint(load("ur5e"))


@pytest.mark.nightly
def test_people_get_tables_of_springs_and_of_errors(tmp_path):
    options = ("--ring-downs", 4, "--payload", "5", "--figures", "maps")
    ended = tvist("identify", *options, cwd=tmp_path).assert_done()
    for words in ("gear stiffness", "breakaway", "95 %", "true modes", "calibration.json"):
        assert words in ended.out
    drawn = {path.name for path in (tmp_path / "maps").iterdir()}
    assert drawn == {"identification.png", "map_f_d.png", "map_zeta.png"}


@pytest.mark.nightly
def test_it_finds_the_same_over_the_network_as_in_process(lockstep, tmp_path):
    options = ("--ring-downs", 4, "--payload", "0,5", "--json")
    found = []
    for name, endpoint in (("network", (lockstep.endpoint,)), ("process", ())):
        path = tmp_path / f"{name}.json"
        tvist("identify", *endpoint, *options, "--output", path).assert_done()
        found.append(json.loads(path.read_text(encoding="utf-8"))["modal"]["parameters"])
    for there, here in zip(*found, strict=True):
        assert there["value"] == pytest.approx(here["value"], rel=0.02)


def test_the_payload_of_a_served_robot_is_found_and_declared(lockstep):
    options = ("--payload", "--json")
    said = tvist("identify", lockstep.endpoint, *options, "--declare").assert_done().json
    assert said["mass_kg"] == pytest.approx(5.0, abs=0.05)
    assert said["com_m"] == pytest.approx([0.0, 0.0, 0.0405], abs=0.003)
    assert said["declared"] is True
    again = tvist("identify", *options[:1], lockstep.endpoint, *options[1:]).assert_done().json
    assert again["declared_kg"] == pytest.approx(said["mass_kg"])
    assert again["set_payload"]["mass"] == again["mass_kg"]


@pytest.fixture(scope="module")
def day(tmp_path_factory):
    """A recording of seven unshaped moves."""
    folder = tmp_path_factory.mktemp("day")
    wave = Path(__file__).parents[2] / "clients" / "examples" / "wave.script"
    how = ("--lockstep", "--shaper", "none", "--payload", "2", "--record", "day.mcap")
    tvist("run", wave, *how, cwd=folder).assert_done()
    return folder / "day.mcap"


def test_a_recording_alone_makes_a_calibration_and_proposes_moves(day, tmp_path):
    path = tmp_path / "mine.json"
    said = tvist("identify", day, "--output", path, "--json").assert_done().json
    assert said["stops"] == 7
    assert said["used"] + sum(said["unused"].values()) == 7
    assert said["payloads_kg"] == [2.0]
    assert len(said["proposals"]) == 3
    assert all(one["commands"][-1].startswith("tvist move ") for one in said["proposals"])
    calibration = calibration_from_json(path.read_bytes())
    assert calibration.modal is not None
    assert {one.status for one in calibration.modal.parameters} == {"identified", "not identifiable"}


def test_a_twin_of_a_recording_can_be_served(day, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    path = tmp_path / "robot.toml"
    said = tvist("identify", day, "--twin", "--json").assert_done().json
    assert said["motions"] >= 4
    assert said["residual_error_percent"] < 25.0
    assert said["payloads"][0]["carried_kg"] == pytest.approx(2.0, abs=0.1)
    assert load(path).payload.mass == pytest.approx(said["payloads"][0]["carried_kg"])
    with Served("--robot", path, "--clock", "lockstep") as robot:
        assert robot.endpoint
    tvist("identify", day, "--twin").assert_failed(1, "robot.toml exists already", "--output")


@pytest.mark.parametrize(
    ("arguments", "named"),
    [
        (("tcp/127.0.0.1:7447", "x.mcap"), "give one robot, or logs alone"),
        (("--columns", "time=t"), "columns is for logs"),
        (("--twin",), "twin is for logs"),
        (("x.mcap", "--payload", "0,5"), "payload is several masses"),
        (("x.mcap", "--twin", "--payload=-1"), "payload is -1"),
    ],
)
def test_logs_and_robots_are_not_mixed(arguments, named, tmp_path):
    tvist("identify", *arguments, cwd=tmp_path).assert_failed(2, named)


@pytest.mark.parametrize(
    ("arguments", "named"),
    [
        (("ur://127.0.0.1:1",), "give --yes"),
        (("ur://", "--yes"), "must be ur://ADDRESS"),
        (("ur://127.0.0.1:1", "x.mcap", "--yes"), "give one robot, or logs alone"),
        (("ur://127.0.0.1:1", "--yes", "--robot", "none-such"), "none-such"),
        (("--yes",), "yes is for a robot at ur://"),
    ],
)
def test_a_robot_is_not_moved_without_a_word_or_from_elsewhere(arguments, named, tmp_path):
    tvist("identify", *arguments, cwd=tmp_path).assert_failed(2, named)
    assert list(tmp_path.iterdir()) == []


def test_a_robot_that_is_not_there_is_a_sentence(tmp_path):
    ended = tvist("identify", "ur://127.0.0.1:1", "--yes", cwd=tmp_path)
    assert ended.code == 1
    assert "no robot answers at ur://127.0.0.1:1" in ended.err
    assert list(tmp_path.iterdir()) == []
