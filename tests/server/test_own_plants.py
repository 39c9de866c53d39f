"""Own plants and hidden robots: loaded, made for a robot, recorded by name or seed, and replayed."""

import pickle
from pathlib import Path

import msgspec
import numpy as np
import pytest
from tests.controller.robots import Q2, UR5E, setup

from tvist_controller.about import info_of
from tvist_controller.loopback import LoopbackHost
from tvist_controller.setup import Setup, body
from tvist_controller.sources.own_files import OwnFileError
from tvist_controller.sources.own_plants import OwnPlant, load_plant
from tvist_controller.sources.own_shapers import load_own
from tvist_lab.in_process import free_setup
from tvist_lab.recordings.mcap_file import read
from tvist_lab.replay import ReplayError, replay_file
from tvist_plant.plant import Plant
from tvist_plant.variants import hidden, hidden_payload
from tvist_plant.world.mujoco_arm import MujocoArm
from tvist_protocol import commands as c
from tvist_protocol.codec import decode_reply, encode
from tvist_server.config import ServeConfig
from tvist_server.option_values import StartError
from tvist_server.recording.recorder import Recorder
from tvist_server.schedule import ExternalTicks
from tvist_server.shutdown import SignalExit
from tvist_server.workers import _rehearse

ECHO = """
import numpy as np
from tvist_plant.plant import Measurement
from tvist_shaping import zv

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

def mine(f_d, zeta):
    return zv(f_d, zeta)
"""


@pytest.fixture
def place(tmp_path):
    file = tmp_path / "echo.py"
    file.write_text(ECHO)
    return f"{file}:Echo"


def test_an_installed_plant_is_found_by_name():
    assert type(load_plant("mujoco").make(UR5E, body(setup().payload))).__name__ == MujocoArm.__name__
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
def test_a_plant_that_cannot_be_made_is_refused_with_the_reason(place, name, said):
    plant = load_plant(place.replace("Echo", name))
    with pytest.raises(OwnFileError, match=said):
        plant.make(UR5E, UR5E.payload)


@pytest.mark.parametrize("kind", ["import", "make"])
def test_a_signal_while_a_plant_loads_ends_the_process(tmp_path, kind):
    file = tmp_path / "slow.py"
    text = "from tvist_server.shutdown import SignalExit\ndef make(*_): raise SignalExit(0)\n"
    file.write_text(text + ("make(0, 0)\n" if kind == "import" else ""))
    with pytest.raises(SignalExit):
        load_plant(f"{file}:make").make(UR5E, UR5E.payload)


@pytest.mark.parametrize(("load", "name"), [(load_plant, "Echo"), (load_own, "mine")])
def test_a_plant_or_shaper_is_pickled_by_reference_to_its_unchanged_file(place, load, name):
    place = place.replace("Echo", name)
    own = load(place)
    assert pickle.loads(pickle.dumps(own)) == own  # noqa: S301  our own
    file = Path(place.rsplit(":", 1)[0])
    file.write_text(ECHO + "\n")
    other = pickle.dumps(load(place))
    file.write_text(ECHO)
    with pytest.raises(OwnFileError, match="has changed"):
        pickle.loads(other)  # noqa: S301  our own


def moved(chosen, path, ticks=300):
    host = LoopbackHost(chosen)
    token = decode_reply(host.request("a", encode(c.TakeControl(client="a", lease_s=30.0)))).token
    assert decode_reply(host.request("a", encode(c.MoveJ(token=token, q=tuple(Q2.tolist()))))).id == 1
    controller = host.controller
    with Recorder(path, info_of(controller), controller.setup.to_builtins()) as recorder:
        for entry in host.entries:
            recorder.journal(entry)
        for _ in range(ticks):
            recorder.state(controller.tick()[0])
    return read(path)


def test_a_run_with_an_own_plant_is_recorded_and_replayed(tmp_path, place):
    own = load_plant(place)
    content = moved(setup(plant=own), tmp_path / "run.mcap")
    assert content.start["plant"] == {"place": place, "sha256": own.sha256}
    assert Setup.from_builtins(content.start, plant=own) == setup(plant=own)
    assert replay_file(content, plant=own).first_difference is None
    with pytest.raises(ReplayError, match=f"give --plant {place}"):
        replay_file(content)
    real = "ur://192.168.0.10"
    content.start["plant"] = {"place": real, "sha256": ""}
    with pytest.raises(ReplayError, match="it cannot be replayed"):
        replay_file(content)
    with pytest.raises(OwnFileError, match="use it with tvist serve"):
        load_plant(real)


def test_compiling_ahead_does_not_connect_to_a_user_plant():
    _rehearse(setup(plant=OwnPlant("real.py:Arm", "", lambda *_: pytest.fail("it was touched"))))


def test_a_replay_refuses_a_plant_that_was_not_served(tmp_path, place):
    content = moved(setup(), tmp_path / "run.mcap", 10)
    with pytest.raises(ReplayError, match="was served without the plant"):
        replay_file(content, plant=load_plant(place))


def test_long_gaps_between_ticks_of_an_arm_count_as_late_or_missed():
    followed, found, now = ExternalTicks(0.002, 5.0), [], 5.0
    for gap in (0.002, 0.0025, 0.0015, 0.0071):
        now += gap
        found.append(followed.begin(now))
    robots, late, missed = zip(*found, strict=True)
    assert (robots, missed) == ((0, 0, 0, 0), (0, 0, 0, 2))
    assert late == pytest.approx((0.0, 0.0005, 0.0, 0.0051), abs=1e-9)


SEED = 314159
"""Of a hidden robot."""


def test_a_hidden_robot_replays_exactly_and_publishes_no_hidden_value(tmp_path):
    """Recorded setup and published info are those of the robot file, without any hidden value."""
    found = moved(setup(hidden=SEED), tmp_path / "hidden.mcap")
    again = replay_file(found)
    assert (again.first_difference, len(again.truths)) == (None, 0)
    plain = moved(setup(), tmp_path / "plain.mcap")
    other = moved(setup(hidden=SEED + 1), tmp_path / "other.mcap")
    for one in (plain, other):
        assert np.abs(np.array(found.states[-1].actual_q) - one.states[-1].actual_q).max() > 1e-5
    assert [state.target_q for state in found.states] == [state.target_q for state in plain.states]
    assert Setup.from_builtins(found.start) == setup(hidden=SEED)
    assert found.start.pop("hidden") == SEED
    assert (found.start, found.info) == (plain.start, plain.info)
    truly, carried = hidden(UR5E, SEED), hidden_payload(body(setup().payload), SEED)
    secrets = [*truly.drives.gear_stiffness, *truly.drives.velocity_gain, *carried.com, carried.mass]
    told = msgspec.json.encode((found.start, found.info, found.states)).decode()
    assert not [value for value in secrets if f"{value!r}"[:9] in told]


def test_the_plant_of_a_hidden_robot_reveals_nothing():
    plant = setup(hidden=SEED).made_plant()
    for ability in (Plant.truth, Plant.modes, Plant.held):
        assert not plant.can(ability)
    assert plant.payload == body(setup().payload)


@pytest.mark.parametrize("given", [{"truth": True}, {"plant": load_plant("stribeck")}])
def test_options_that_would_reveal_a_hidden_robot_are_refused(given):
    with pytest.raises(ValueError, match=f"hidden is {SEED}, but .*: leave one of them out"):
        setup(hidden=SEED, **given).check()


def test_each_hidden_robot_has_its_own_seed():
    assert [one.hidden for one in ServeConfig(robots="ur5e*2", hidden=5).setups()] == [5, 6]
    assert free_setup(hidden=5, truth=False).hidden == 5
    with pytest.raises(StartError, match="hidden is 5, but truth is on"):
        free_setup(hidden=5)
