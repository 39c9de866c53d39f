"""A robot in a scene: its configuration, a program that grips, its recording and the judged areas."""

import re

import msgspec
import numpy as np
import pytest
from tests.controller.robots import UR5E, Robot

from tvist_lab.programs.judging import is_inside, missed
from tvist_lab.programs.limits import RunLimits
from tvist_lab.programs.running import run_in_lockstep
from tvist_lab.recordings.mcap_file import read
from tvist_lab.replay import ReplayError, replay_file
from tvist_plant.surroundings import Shape
from tvist_plant.world.mujoco_arm import MujocoArm
from tvist_plant.world.scene import build
from tvist_plant.world.scene_file import find_scene
from tvist_protocol import commands as c
from tvist_protocol.replies import Accepted
from tvist_protocol.simulation import SimulationReset
from tvist_protocol.values import Payload
from tvist_server.config import ServeConfig
from tvist_server.option_values import StartError

CELL = """
world = "table"

[[tools]]
name = "2F-85"
mass = 0.92
cog = [0.0, 0.0, 0.058]
tcp = [0.0, 0.0, 0.163, 0.0, 0.0, 0.0]

[gripper]
model = "2F-85"
activated = true
"""
ABOVE = "-2.3046,-1.663,-1.6661,-1.3833,1.5709,0.837"
"""A posture with the gripper over the box."""
LIFT = """def lift():
  movel(p[-0.45, -0.3, 0.15, 2.2214, 2.2214, 0], a=2, v=0.5)
  rq_set_force(80)
  rq_close_and_wait()
  movel(p[-0.45, -0.3, 0.25, 2.2214, 2.2214, 0], a=2, v=0.5)
  sleep(0.2)
end
"""
HEAVY = Payload(mass=5.0, com=(0.0, 0.0, 0.05), inertia=(0.01, 0.0, 0.0, 0.01, 0.0, 0.01))


@pytest.fixture(autouse=True)
def built_here(monkeypatch):
    """Build scenes in this process; tests/plant/test_world.py builds them apart."""
    monkeypatch.setattr("tvist_plant.world.mujoco_arm.build_apart", lambda asked: build(*asked))


def config(tmp_path, cell=CELL):
    file = tmp_path / "cell.toml"
    file.write_text(cell)
    return ServeConfig(cell=str(file), profile="ursim", clock="free", start=ABOVE)


def ran(setup, text, record=None):
    return run_in_lockstep(setup, text, (), record=record, attend=lambda _: None, on_record_error=pytest.fail)


def test_a_program_lifts_a_box_and_its_replay_is_equal(tmp_path):
    file = tmp_path / "run.mcap"
    watch = ran(config(tmp_path).setup(), LIFT, file)
    assert watch.reason == "finished"
    places = dict(zip(watch.plant.things().bodies, watch.plant.places(), strict=True))
    assert places["box"][2] == pytest.approx(0.24, abs=0.005)
    (said,) = [said.text for said in watch.said if said.text.startswith("cell")]
    assert re.fullmatch(r"cell: the gripper holds something (59|60)\.\d mm wide", said)
    assert 3.0 < watch.hardest.speed < 100.0
    expected = RunLimits(expect=["box in left", "box in nowhere", "ball in left"])
    said = [one.text for one in missed(expected, watch.plant)]
    assert "which is not in left" in said[0]
    assert "has no area 'nowhere': it has left" in said[1]
    assert "has no body 'ball': it has finger left, finger right, box" in said[2]
    content = read(file)
    assert content.start["plant"]["place"] == "world:table"
    assert content.info.geometry.world.bodies == ["finger left", "finger right", "box"]
    np.testing.assert_array_equal(content.truths[-1].body_poses[12:], places["box"])
    done = replay_file(content)
    assert (done.first_difference, done.notes) == (None, [])
    with pytest.raises(ValueError, match="must be BODY in AREA"):
        RunLimits(expect=["box 1"]).check()


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"world": "nowhere"}, "world is 'nowhere': must be one of pallet, peg, table, wall, or a file"),
        ({"world": "table", "plant": "mujoco"}, "world is table, .* but plant is mujoco: leave one out"),
        ({"world": "table", "hidden": 3}, "world is table, .* but hidden is 3: leave one out"),
    ],
)
def test_options_that_exclude_a_world_are_refused(given, said, tmp_path):
    with pytest.raises(StartError, match=said):
        ServeConfig(**given).setup()
    part = '\n[[parts]]\nname = "box"\nmass = 1.0\nsize = [0.1, 0.05, 0.1]\npose = [0, 0, 1, 0, 0, 0]\n'
    with pytest.raises(StartError, match="in which bodies are gripped: leave parts out"):
        config(tmp_path, CELL + part).setup()


def test_a_start_inside_an_obstacle_is_refused(tmp_path):
    wall = tmp_path / "wall.xml"
    wall.write_text('<mujoco><worldbody><geom type="box" size="1 1 1"/></worldbody></mujoco>')
    why = r"world .*wall.xml: .* stands .* mm inside shape 0: choose a posture"
    with pytest.raises(StartError, match=why):
        ran(ServeConfig(world=str(wall), clock="free").setup(), "def a():\nend")


@pytest.mark.parametrize("given", [{"q": (-2.7, -2.2, -1.8, -0.7, 1.57, 0.0)}, {"payload": HEAVY}])
def test_a_reset_into_an_obstacle_is_refused_and_changes_nothing(given, tmp_path):
    """The arm stands so close to the plate that a heavier payload would bend it into the plate."""
    clear, light = (-2.7, -1.8, -1.8, -1.1, 1.57, 0.0), msgspec.structs.replace(HEAVY, mass=0.1)
    x, y, z = Robot(q=clear, carried=light, truth=True).controller.truth().flange_pose[:3]
    (tmp_path / "scene.xml").write_text(
        '<mujoco><worldbody><body name="tool"><geom type="sphere" size="0.01" pos="0 0 0.1"/></body><geom name="plate" '
        f'type="box" size="0.1 0.1 0.01" pos="{x} {y} {z - 0.12 - 4e-4}"/></worldbody></mujoco>'
    )
    scene = find_scene(str(tmp_path / "scene.xml"))
    plants = MujocoArm(UR5E, UR5E.payload, scene), MujocoArm(UR5E, UR5E.payload, scene)
    robots = [Robot(q=clear, carried=light, plant=plant, truth=True) for plant in plants]
    for one in robots:
        one.tick(5)
    reply = robots[0].send(SimulationReset, **given, seed=7, mode="IDLE", shaper="ei")
    assert (reply.code, reply.where) == ("collision", next(iter(given)))
    assert "mm inside plate: choose a posture" in reply.why
    for one in robots:
        assert isinstance(one.send(c.MoveJ, q=(-2.7, -1.7, -1.7, -1.3, 1.57, 0.0)), Accepted)
        one.until_rest()
    assert robots[0].states == robots[1].states
    assert robots[0].events == robots[1].events
    assert robots[0].controller.truth() == robots[1].controller.truth()


def test_a_replay_notes_a_changed_scene_and_needs_a_missing_one(tmp_path):
    scene, file = tmp_path / "own.xml", tmp_path / "run.mcap"
    scene.write_text('<mujoco><worldbody><geom size="0.1" pos="3 3 3"/></worldbody></mujoco>')
    ran(ServeConfig(world=str(scene), clock="free").setup(), "def a():\n  sleep(0.1)\nend", file)
    scene.write_text('<mujoco><worldbody><geom size="0.2" pos="3 3 3"/></worldbody></mujoco>')
    assert "not what it was" in replay_file(read(file)).notes[0]
    scene.unlink()
    with pytest.raises(ReplayError, match="give --plant world:FILE"):
        replay_file(read(file))


@pytest.mark.parametrize(
    ("kind", "inside", "outside"),
    [
        ("box", (0.9, -1.9, 2.9), (1.1, 0.0, 0.0)),
        ("sphere", (0.5, 0.5, 0.5), (0.7, 0.7, 0.7)),
        ("ellipsoid", (0.0, 0.0, 2.9), (0.9, 0.0, 2.0)),
        ("cylinder", (0.6, 0.6, 1.9), (0.8, 0.8, 0.0)),
        ("capsule", (0.0, 0.0, 2.9), (0.8, 0.0, 2.9)),
    ],
)
def test_an_area_contains_the_points_of_its_shape(kind, inside, outside):
    area = Shape(kind, (1.0, 2.0, 3.0), (0.0,) * 6, None, (0.0,) * 4)
    assert is_inside(area, np.array(inside))
    assert not is_inside(area, np.array(outside))
