"""`tvist identify`: jogs in process and over a network, logs, twins, payloads; and where it cannot be done."""

import json

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
FEWER = {
    "calibrate.CANDIDATES": 12, "calibrate.PLACES": 10, "calibrate.UNSEEN": 10, "calibrate.WORKSPACE": 10,
    "jogs.CANDIDATES": 12, "modal_fit.SOFTENINGS": (0.0, 300.0), "modal_fit.STARTS": 1, "payload.POSES": 3,
    "twin.ROUNDS": 2,
}  # fmt: skip
"""Numbers of the identification with which its results are less accurate, and less is known of them."""
SWINGS = """def swings():
  n = 0
  while n < 2:
    movej([0.4, -0.3], a=3, v=2)
    sleep(0.5)
    movej([0.0, 0.0], a=3, v=2)
    sleep(0.5)
    n = n + 1
  end
end
"""


@pytest.fixture
def identify(called, monkeypatch):
    """Run `tvist identify` in this process."""
    for name, number in FEWER.items():
        monkeypatch.setattr(f"tvist_lab.identification.{name}", number)
    return lambda *arguments: called("identify", *arguments).assert_done()


@pytest.fixture
def identified(identify):
    """Run `tvist identify` in this process; return what it prints as JSON."""
    return lambda *arguments: identify(*arguments, "--json").json


def test_identify_writes_a_calibration_of_the_one_joint_arm(identify, tmp_path):
    path, command = tmp_path / "mine.json", "--robot one-joint --ring-downs 4 --payload 1"
    said = " ".join(identify(*command.split(), "--output", path).out.split())
    assert said.startswith("4 of 4 ring-downs with 1 kg were used, in ")
    assert "deviation of the modes from true modes, unseen poses" in said
    assert f"tvist serve --calibration {path} --robot one-joint" in said
    calibration = calibration_from_json(path.read_bytes())
    assert (calibration.name, calibration.robot) == ("mine", "one-joint arm")
    assert calibration.provenance.command.startswith(f"tvist identify {command} --output")
    assert calibration.provenance.ring_downs == 4
    assert calibration.provenance.arm == fingerprint(load("one-joint"))


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


@pytest.mark.nightly
@pytest.mark.parametrize("name", ["ur10e", "ur20", "ur30"])
def test_arm_whose_weight_takes_most_torque_in_its_first_pose_is_identified(name, identified, tmp_path):
    said = identified("--robot", name, "--ring-downs", 6, "--output", tmp_path / "mine.json")
    assert said["used"] == 6
    assert said["error_f_d_percent"] < 3.0
    weighed = identified("--robot", name, "--payload")
    assert weighed["mass_kg"] == pytest.approx(load(name).payload.mass, rel=0.02)


def test_payload_is_identified(identified):
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
    """A recording of four unshaped moves of the one-joint arm."""
    folder = tmp_path_factory.mktemp("day")
    (folder / "swings.script").write_text(SWINGS, encoding="utf-8")
    how = ("--robot", "one-joint", "--lockstep", "--shaper", "none", "--payload", 1, "--record", "day.mcap")
    tvist("run", "swings.script", *how, cwd=folder).assert_done()
    return folder / "day.mcap"


def test_identify_from_a_recording_writes_a_calibration_and_proposes_moves(day, identified, tmp_path):
    path = tmp_path / "mine.json"
    said = identified(day, "--output", path)
    assert said.keys() >= KEYS
    assert said["stops"] == 4
    assert said["used"] + sum(said["unused"].values()) == 4
    assert said["payloads_kg"] == [1.0]
    assert len(said["proposals"]) == 3
    assert all(one["commands"][-1].startswith("tvist move ") for one in said["proposals"])
    calibration = calibration_from_json(path.read_bytes())
    assert calibration.modal is not None
    assert {one.status for one in calibration.modal.parameters} == {"identified", "not identifiable"}
    assert calibration.provenance.arm == fingerprint(load("one-joint"))


def test_twin_of_a_recording_can_be_served(day, identified, called, tmp_path):
    path = tmp_path / "robot.toml"
    said = identified(day, "--twin")
    assert said["motions"] == 4
    assert said["residual_error_percent"] < 25.0
    assert said["payloads"][0]["carried_kg"] == pytest.approx(1.0, abs=0.1)
    assert load(path).payload.mass == pytest.approx(said["payloads"][0]["carried_kg"])
    with Served("--robot", path, "--clock", "lockstep") as robot:
        assert robot.endpoint
    called("identify", day, "--twin").assert_failed(1, "robot.toml exists already")


def test_missing_robot_is_reported(called, tmp_path):
    code, _, err = called("identify", "ur://127.0.0.1:1", "--yes")
    assert (code, "no robot answers at ur://127.0.0.1:1" in err) == (1, True), err
    assert list(tmp_path.iterdir()) == []
