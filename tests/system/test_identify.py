"""`tvist identify`: jogs in process and over a network, logs, twins, payloads; and where it cannot be done."""

import json
from pathlib import Path

import pytest
from tests.conformance.served import Served
from tests.system.shell import tvist

from tvist_plant.description import fingerprint, load
from tvist_protocol.calibration import calibration_from_json

KEYS = {"configurations", "ring_downs", "error_f_d_percent", "error_zeta_percent"}


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


def test_a_robot_that_is_not_there_is_a_sentence(tmp_path):
    ended = tvist("identify", "ur://127.0.0.1:1", "--yes", cwd=tmp_path)
    assert ended.code == 1
    assert "no robot answers at ur://127.0.0.1:1" in ended.err
    assert list(tmp_path.iterdir()) == []
