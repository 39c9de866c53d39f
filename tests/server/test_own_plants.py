"""Plants of one's own: found by their name, made for a robot, kept in a recording by their name, and replayed."""

import json
import pickle
from pathlib import Path

import pytest
from tests.controller.robots import Q2, UR5E, setup
from tests.own_arm import OwnArm

from tvist_controller.about import info_of
from tvist_controller.loopback import LoopbackHost
from tvist_controller.setup import Setup, body
from tvist_controller.sources.own_files import OwnFileError
from tvist_controller.sources.own_plants import (
    OwnPlant,
    RecordedPlant,
    load_plant,
    named_plants,
)
from tvist_lab.recordings.mcap_file import read
from tvist_lab.replay import ReplayError, replay_file
from tvist_plant.world.mujoco_arm import MujocoArm
from tvist_protocol import commands as c
from tvist_protocol.codec import decode_reply, encode
from tvist_server.config import ServeConfig
from tvist_server.ending import SignalExit
from tvist_server.recording.recorder import Recorder
from tvist_server.schedule import Followed
from tvist_server.workers import _rehearse

ECHO = """
import numpy as np
from tvist_plant.plant import Measurement

class Echo:
    def __init__(self, description, payload):
        self.payload = payload

    def reset(self, command, *, payload=None, seed=0):
        return self.step(command)

    def step(self, command):
        return Measurement(command.q, command.qd, np.zeros_like(command.q), np.zeros(3))

def nothing(description, payload):
    return None

def fails(description, payload):
    raise OSError("no cable")

def leaves(description, payload):
    raise SystemExit(3)
"""


@pytest.fixture
def place(tmp_path):
    file = tmp_path / "echo.py"
    file.write_text(ECHO)
    return f"{file}:Echo"


def test_an_installed_one_is_found_by_its_name():
    assert {"mujoco", "combined"} <= set(named_plants())
    made = load_plant("mujoco").make(UR5E, body(setup().payload))
    assert type(made).__name__ == MujocoArm.__name__
    with pytest.raises(OwnFileError, match=r"must be FILE\.py:NAME, or one of calibrated, .*mujoco"):
        load_plant("nobody")


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("nothing", "makes a NoneType, which is no plant"),
        ("fails", "making it raises OSError: no cable"),
        ("leaves", "making it raises SystemExit: 3"),
    ],
)
def test_one_that_cannot_be_made_says_why(place, name, said):
    plant = load_plant(place.replace("Echo", name))
    with pytest.raises(OwnFileError, match=said):
        plant.make(UR5E, UR5E.payload)


@pytest.mark.parametrize("kind", ["import", "make"])
def test_a_signal_that_ends_the_process_meanwhile_is_no_fault_of_its_file(tmp_path, kind):
    file = tmp_path / "slow.py"
    body_of = (
        "from tvist_server.ending import SignalExit\ndef make(description, payload): raise SignalExit(0)\n"
    )
    file.write_text(body_of + ("make(0, 0)\n" if kind == "import" else ""))
    with pytest.raises(SignalExit):
        load_plant(f"{file}:make").make(UR5E, UR5E.payload)


def test_a_configuration_names_it_and_a_worker_finds_it_again(place):
    made = ServeConfig(plant=place).setup()
    assert made.plant == load_plant(place)
    assert pickle.loads(pickle.dumps(made.plant)) == made.plant  # noqa: S301  our own
    file = Path(place.rsplit(":", 1)[0])
    file.write_text(ECHO + "\n")
    other = pickle.dumps(load_plant(place))
    file.write_text(ECHO)
    with pytest.raises(OwnFileError, match="has changed"):
        pickle.loads(other)  # noqa: S301  our own


def recorded(folder, plant=None):
    """The recording of a move."""
    host, path = LoopbackHost(setup(plant=plant)), folder / "run.mcap"
    token = decode_reply(host.request("a", encode(c.TakeControl(client="a", lease_s=30.0)))).token
    assert decode_reply(host.request("a", encode(c.MoveJ(token=token, q=tuple(Q2.tolist()))))).id == 1
    controller = host.controller
    with Recorder(path, info_of(controller), controller.setup.to_builtins()) as recorder:
        for entry in host.entries:
            recorder.journal(entry)
        for _ in range(300):
            recorder.state(controller.tick()[0])
    return read(path)


def test_a_setup_survives_its_recording_and_a_run_its_replay(tmp_path, place):
    own = load_plant(place)
    content = recorded(tmp_path, own)
    assert content.start["plant"] == {"place": place, "sha256": own.sha256}
    kept = json.loads(json.dumps(setup(plant=own).to_builtins()))
    assert Setup.from_builtins(kept, plant=own) == setup(plant=own)
    assert own.recorded == RecordedPlant(place, own.sha256)
    assert replay_file(content, plant=own).first_difference is None
    with pytest.raises(ReplayError, match=f"give --plant {place}"):
        replay_file(content)


def test_a_replay_does_not_move_an_arm_that_gives_the_tick(tmp_path, place):
    content = recorded(tmp_path, load_plant(place))
    real = OwnPlant(place, "", OwnArm)
    with pytest.raises(ValueError, match="the plant OwnArm gives the tick"):
        replay_file(content, plant=real)


def test_a_replay_of_a_real_arm_says_why_there_is_none(tmp_path, place):
    at = "ur://192.168.0.10"
    content = recorded(tmp_path, OwnPlant(at, "", load_plant(place).maker))
    with pytest.raises(ReplayError, match="it cannot be replayed"):
        replay_file(content)
    with pytest.raises(OwnFileError, match="only tvist serve takes"):
        load_plant(at)


def test_only_the_process_that_serves_it_makes_it():
    _rehearse(setup(plant=OwnPlant("real.py:Arm", "", lambda *_: pytest.fail("it was touched"))))


def test_a_plant_is_not_taken_where_there_was_none(tmp_path, place):
    content = recorded(tmp_path)
    assert replay_file(content).first_difference is None
    with pytest.raises(ReplayError, match="was served without the plant"):
        replay_file(content, plant=load_plant(place))


def test_ticks_of_an_arm_are_late_by_what_they_exceed_a_period_and_missed_where_it_left_some_out():
    followed, found, now = Followed(0.002, 5.0), [], 5.0
    for gap in (0.002, 0.0025, 0.0015, 0.0071):
        now += gap
        found.append(followed.begin(now))
    assert [number for number, _, _ in found] == [0, 0, 0, 0]
    assert [late for _, late, _ in found] == pytest.approx([0.0, 0.0005, 0.0, 0.0051], abs=1e-9)
    assert [missed for _, _, missed in found] == [0, 0, 0, 2]
