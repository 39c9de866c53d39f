"""`tvist identify`: jogs in process and over a network, logs, twins, payloads; and where it cannot be done."""

import json
from pathlib import Path

import msgspec
import pytest
from tests.conformance.served import Served
from tests.conformance.wire import Wire
from tests.system.shell import tvist

from tvist_client import make_payload
from tvist_lab.identification.payload import PayloadFound
from tvist_plant.description import fingerprint, load
from tvist_protocol.calibration import calibration_from_json

KEYS = {"configurations", "ring_downs", "error_f_d_percent", "error_zeta_percent"}


@pytest.fixture
def identified(called):
    """Run `tvist identify` in this process; return what it prints as JSON."""

    def run(*arguments):
        code, out, err = called("identify", *map(str, arguments), "--json")
        assert code == 0, err
        return json.loads(out)

    return run


def test_identify_writes_a_calibration(identified, tmp_path):
    path = tmp_path / "mine.json"
    said = identified("--ring-downs", 4, "--output", path)
    assert said.keys() >= KEYS
    assert said["ring_downs"] == 4
    assert said["payloads_kg"] == [0.0, 5.0]
    assert said["error_f_d_percent"] < 6.0
    calibration = calibration_from_json(path.read_bytes())
    assert calibration.name == "mine"
    assert [mode["measured_at_m_s2"] > 0.1 for mode in said["modes"]] == [True] * 3
    assert calibration.provenance.command.startswith("tvist identify --ring-downs 4 --output")
    assert calibration.provenance.arm == fingerprint(load("ur5e"))


@pytest.mark.nightly
def test_identify_finds_the_same_over_the_network_as_in_process(lockstep, tmp_path):
    options = ("--ring-downs", 4, "--payload", "0,5", "--json")
    found = []
    for name, endpoint in (("network", (lockstep.endpoint,)), ("process", ())):
        path = tmp_path / f"{name}.json"
        tvist("identify", *endpoint, *options, "--output", path).assert_done()
        found.append(json.loads(path.read_text(encoding="utf-8"))["modal"]["parameters"])
    for there, here in zip(*found, strict=True):
        assert there["value"] == pytest.approx(here["value"], rel=0.02)


def test_payload_is_identified(identified, monkeypatch):
    monkeypatch.setattr("tvist_lab.identification.payload.POSES", 3)
    said = identified("--payload")
    assert said["mass_kg"] == said["set_payload"]["mass"] == pytest.approx(5.0, abs=0.05)
    assert said["mass_kg"] <= 5.0  # what is rated, or it could not be declared
    assert said["com_m"] == pytest.approx([0.0, 0.0, 0.0405], abs=0.003)
    assert said["declared"] is False


def test_identified_payload_is_declared_to_a_served_robot(lockstep, identified, monkeypatch):
    payload = make_payload(2.5, (0.0, 0.01, 0.05), (0.003, 0.0, 0.0, 0.003, 0.0, 0.003))

    async def found(*_, **__):
        return PayloadFound(payload, 0.01, (0.001,) * 3, 2.5, 0.1, payload, 6)

    monkeypatch.setattr("tvist_cli.identifying.identify_payload", found)
    assert identified(lockstep.endpoint, "--payload", "--declare")["declared"] is True
    with Wire(lockstep.endpoint) as wire:
        assert wire.info()["payload"] == msgspec.json.decode(msgspec.json.encode(payload))


@pytest.fixture(scope="module")
def day(tmp_path_factory):
    """A recording of five unshaped moves."""
    folder = tmp_path_factory.mktemp("day")
    example = Path(__file__).parents[2] / "clients" / "examples" / "wave.script"
    wave = folder / "wave.script"
    wave.write_text(example.read_text(encoding="utf-8").replace("times < 3", "times < 2"), encoding="utf-8")
    how = ("--lockstep", "--shaper", "none", "--payload", "2", "--record", "day.mcap")
    tvist("run", wave, *how, cwd=folder).assert_done()
    return folder / "day.mcap"


def test_identify_from_a_recording_writes_a_calibration_and_proposes_moves(day, identified, tmp_path):
    path = tmp_path / "mine.json"
    said = identified(day, "--output", path)
    assert said["stops"] == 5
    assert said["used"] + sum(said["unused"].values()) == 5
    assert said["payloads_kg"] == [2.0]
    assert len(said["proposals"]) == 3
    assert all(one["commands"][-1].startswith("tvist move ") for one in said["proposals"])
    calibration = calibration_from_json(path.read_bytes())
    assert calibration.modal is not None
    assert {one.status for one in calibration.modal.parameters} == {"identified", "not identifiable"}


def test_twin_of_a_recording_can_be_served(day, identified, called, tmp_path):
    path = tmp_path / "robot.toml"
    said = identified(day, "--twin")
    assert said["motions"] >= 4
    assert said["residual_error_percent"] < 25.0
    assert said["payloads"][0]["carried_kg"] == pytest.approx(2.0, abs=0.1)
    assert load(path).payload.mass == pytest.approx(said["payloads"][0]["carried_kg"])
    with Served("--robot", path, "--clock", "lockstep") as robot:
        assert robot.endpoint
    code, _, err = called("identify", str(day), "--twin")
    assert code == 1
    assert "robot.toml exists already" in err


def test_missing_robot_is_reported(called, tmp_path):
    code, _, err = called("identify", "ur://127.0.0.1:1", "--yes")
    assert code == 1
    assert "no robot answers at ur://127.0.0.1:1" in err
    assert list(tmp_path.iterdir()) == []
