"""Profiles: what they set, and what an explicit option still changes."""

from importlib import resources

import msgspec
import numpy as np
import pytest
from tests.controller.robots import UR5E, Robot, cut, setup
from tests.server.test_config import config, sentence

from tvist_controller.foresight.collision import CollisionModel
from tvist_controller.kinematics.postures import is_of_ur_form
from tvist_controller.setup import Setup, body, paper_payload
from tvist_plant.description import load
from tvist_protocol import commands as c
from tvist_server.config import ServeConfig, from_mapping
from tvist_server.profiles import UR_START


def test_without_a_profile_every_option_has_the_default_it_always_had():
    made, shipped = ServeConfig().setup(), load("ur5e")
    assert ServeConfig().profile_in_force is None
    assert made.description == shipped
    assert (made.q, made.payload, made.carried) == (shipped.poses["Q1"], paper_payload(shipped), None)
    assert (made.shaper, made.compensate_sag, made.shape_servo) == ("zv", False, False)


@pytest.mark.parametrize("options", [{"ur": True}, {"profile": "ursim"}, {"ur": True, "profile": "ursim"}])
def test_ursim_is_the_profile_of_ur_s_interfaces(options):
    made = config(**options).setup()
    assert made.q == UR_START
    assert made.payload.mass == 0.0
    assert made.carried is None
    assert (made.shaper, made.compensate_sag, made.shape_servo) == ("none", True, False)
    assert made.description == UR5E.quiet().without_floor()


@pytest.mark.parametrize("options", [{"profile": "real"}, {"ur": True, "profile": "real"}])
def test_real_is_a_robot_without_a_profile_in_ur_s_posture(options):
    made = config(**options).setup()
    assert made.q == UR_START
    assert msgspec.structs.asdict(made.payload) == msgspec.structs.asdict(config().setup().payload)
    assert made.to_builtins() | {"q": None} == config().setup().to_builtins() | {"q": None}


@pytest.mark.parametrize("profile", ["ursim", "real"])
@pytest.mark.parametrize(
    ("option", "read", "expected"),
    [
        ({"payload": 2.0}, lambda made: made.payload.mass, 2.0),
        ({"start": "Q3"}, lambda made: made.q, UR5E.poses["Q3"]),
        ({"shaper": "ei"}, lambda made: made.shaper, "ei"),
        ({"quiet": True}, lambda made: made.description.sensors, UR5E.quiet().sensors),
        ({"quiet": False}, lambda made: made.description.sensors, UR5E.sensors),
        ({"floor": True}, lambda made: made.description.collision, UR5E.collision),
        ({"floor": False}, lambda made: made.description.collision, UR5E.without_floor().collision),
        ({"compensate_sag": True}, lambda made: made.compensate_sag, True),
        ({"compensate_sag": False}, lambda made: made.compensate_sag, False),
    ],
)
def test_an_explicit_option_takes_precedence(profile, option, read, expected):
    assert read(config(profile=profile, **option).setup()) == expected


def test_a_state_takes_precedence_too(tmp_path):
    file = tmp_path / "state.toml"
    file.write_text('q = [0.0, -1.5, 1.5, 0.0, 0.0, 0.0]\nshaper = "ei"\n')
    made = config(ur=True, state=str(file)).setup()
    assert (made.q, made.shaper, made.payload.mass) == ((0.0, -1.5, 1.5, 0.0, 0.0, 0.0), "ei", 0.0)


def test_an_arm_that_is_not_of_ur_s_form_starts_in_its_own_posture():
    made = from_mapping({"robot": "one-joint", "ur": True}, "tvist.toml").setup()
    assert made.q == load("one-joint").poses["Q1"]
    assert made.payload.mass == 0.0
    assert [is_of_ur_form(arm) for arm in (UR5E, cut(5), load("one-joint"))] == [True, False, False]


def test_several_robots_share_the_profile():
    for made in from_mapping({"robots": "ur5e*2", "ur": True}, "tvist.toml").setups():
        assert (made.q, made.shaper) == (UR_START, "none")


def test_a_profile_that_does_not_exist_is_refused():
    assert "profile" in sentence(lambda: config(profile="urzim"))


def test_without_a_floor_nothing_meets_it_and_the_arm_still_meets_itself():
    payload = body(paper_payload(UR5E))
    below = np.array([0.0, 0.5, 0.0, 0.0, 0.0, 0.0])
    folded = np.array([0.0, -1.57, 3.0, 0.0, 0.0, 0.0])
    free = CollisionModel(UR5E.without_floor(), payload)
    assert CollisionModel(UR5E, payload).meeting(below).second == "floor"
    assert free.meeting(below) is None
    assert free.meeting(folded) == CollisionModel(UR5E, payload).meeting(folded)


@pytest.mark.parametrize(("options", "reply"), [({}, "Accepted"), ({"floor": True}, "Refused")])
def test_the_posture_of_all_zeros_is_reached_where_there_is_no_floor(options, reply):
    made = config(profile="ursim", start="0,-0.5,-0.5,-1.6,1.6,0", **options).setup()
    robot = Robot(made.description, q=made.q, payload=made.payload, shaper=made.shaper)
    assert type(robot.send(c.MoveJ, q=(0.0,) * 6)).__name__ == reply


def test_the_options_are_part_of_a_recording_and_older_ones_have_none():
    made = setup(compensate_sag=True, shape_servo=True, description=UR5E.without_floor())
    content = made.to_builtins()
    assert Setup.from_builtins(content) == made
    del content["compensate_sag"], content["shape_servo"], content["description"]["collision"]["has_floor"]
    older = Setup.from_builtins(content)
    assert (older.compensate_sag, older.shape_servo, older.description) == (False, False, UR5E)


def test_programs_servo_unshaped_unless_asked():
    assert config(ur=True, shape_servo=True).setup().shape_servo


def test_a_robot_file_may_have_no_floor(tmp_path):
    text = (resources.files("tvist_plant") / "robots" / "ur5e.toml").read_text(encoding="utf-8")
    path = tmp_path / "hanging.toml"
    path.write_text(text.replace("floor  = 0.0 ", "has_floor = false\nfloor  = 0.0 "), encoding="utf-8")
    assert config(robot=str(path)).setup().description == UR5E.without_floor()
    assert not config(robot=str(path), floor=True).setup().description.collision.has_floor
