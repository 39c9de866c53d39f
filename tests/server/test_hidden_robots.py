"""A hidden robot and a plant by name, served: nothing tells what they are, and recordings replay to the last bit."""

import json
from dataclasses import replace

import msgspec
import numpy as np
import pytest
from tests.controller.robots import Q2, UR5E, setup

from tvist_controller.about import info_of
from tvist_controller.loopback import LoopbackHost
from tvist_controller.setup import Setup, body
from tvist_controller.sources.own_files import OwnFileError
from tvist_controller.sources.own_plants import load_plant
from tvist_lab.in_process import free_setup
from tvist_lab.recordings.mcap_file import read
from tvist_lab.replay import replay_file
from tvist_plant.description import load
from tvist_plant.plant import Plant
from tvist_plant.variants import hidden, hidden_payload
from tvist_protocol import commands as c
from tvist_protocol.codec import decode_reply, encode
from tvist_server.config import ServeConfig
from tvist_server.option_values import StartError
from tvist_server.recording.recorder import Recorder

SEED = 314159


def moved(chosen: Setup, path=None, ticks: int = 700):
    """The states of a move, and what its recorder was told; the recording is at the path."""
    host = LoopbackHost(chosen)
    token = decode_reply(host.request("a", encode(c.TakeControl(client="a", lease_s=30.0)))).token
    assert decode_reply(host.request("a", encode(c.MoveJ(token=token, q=tuple(Q2.tolist()))))).id == 1
    controller, states = host.controller, []
    start = json.loads(json.dumps(controller.setup.to_builtins()))
    if path is None:
        return [controller.tick()[0] for _ in range(ticks)], start, info_of(controller)
    with Recorder(path, info_of(controller), start) as recorder:
        for entry in host.entries:
            recorder.journal(entry)
        for _ in range(ticks):
            states.append(controller.tick()[0])
            recorder.state(states[-1])
    return states, start, info_of(controller)


def test_a_hidden_robot_replays_to_the_last_bit_and_moves_otherwise_than_its_file(tmp_path):
    path = tmp_path / "hidden.mcap"
    states, start, _ = moved(setup(hidden=SEED), path)
    again = replay_file(read(path))
    assert again.first_difference is None
    assert not again.truths
    plain, _, _ = moved(setup())
    other, _, _ = moved(setup(hidden=SEED + 1))
    for one in (plain, other):
        assert np.abs(np.array(states[-1].actual_q) - one[-1].actual_q).max() > 1e-5
    assert [state.target_q for state in states] == [state.target_q for state in plain]
    assert Setup.from_builtins(start) == replace(setup(hidden=SEED))


def test_only_the_seed_tells_of_it():
    """Recorded setup and published info are those of the file, and no value that was drawn is in them or in a state."""
    states, start, info = moved(setup(hidden=SEED), ticks=50)
    _, plain_start, plain_info = moved(setup(), ticks=50)
    assert start.pop("hidden") == SEED
    assert (start, info) == (plain_start, plain_info)
    truly, carried = hidden(UR5E, SEED), hidden_payload(body(setup().payload), SEED)
    secrets = [*truly.drives.gear_stiffness, *truly.drives.velocity_gain, *carried.com, carried.mass]
    told = msgspec.json.encode((start, info, states)).decode()
    assert not [value for value in secrets if f"{value!r}"[:9] in told]


def test_its_plant_has_no_ability_that_would_tell():
    plant = setup(hidden=SEED).made_plant()
    for ability in (Plant.truth, Plant.modes, Plant.held):
        assert not plant.can(ability)
    assert plant.payload == body(setup().payload)


@pytest.mark.parametrize("given", [{"truth": True}, {"plant": load_plant("stribeck")}])
def test_what_would_tell_is_refused(given):
    with pytest.raises(ValueError, match=f"hidden is {SEED}, but .*: leave one of them out"):
        setup(hidden=SEED, **given).check()


def test_several_hidden_robots_are_different_ones():
    config = ServeConfig(robots="ur5e*2", hidden=5)
    assert [one.hidden for one in config.setups()] == [5, 6]
    assert free_setup(hidden=5, truth=False).hidden == 5
    with pytest.raises(StartError, match="hidden is 5, but truth is on"):
        free_setup(hidden=5)


def test_a_plant_by_name_draws_by_the_robots_seed_and_is_found_again_by_a_replay(tmp_path):
    path = tmp_path / "combined.mcap"
    states, start, _ = moved(setup(plant=load_plant("combined"), seed=3, truth=True), path)
    assert start["plant"] == {"place": "combined", "sha256": ""}
    again = replay_file(read(path))
    assert again.first_difference is None
    assert len(again.truths) == len(states)
    other, _, _ = moved(setup(plant=load_plant("combined"), seed=4))
    assert np.abs(np.array(states[-1].actual_q) - other[-1].actual_q).max() > 1e-5


def test_an_arm_that_cannot_be_what_the_name_says_is_refused():
    one_joint = load("one-joint")
    with pytest.raises(OwnFileError, match="plant torsion: torsion is 20000 N m/rad, but no link"):
        load_plant("torsion").make(one_joint, one_joint.payload)
