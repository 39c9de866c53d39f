"""Configuration and profiles: invalid values are refused with their key, and options have their effect."""

import json
import tomllib
from importlib import resources

import msgspec
import pytest
from tests.controller.robots import UR5E, calibration, cut, setup

from tvist_controller.kinematics.postures import is_of_ur_form
from tvist_controller.setup import Setup, paper_payload
from tvist_controller.sources import calibrations
from tvist_plant.description import load
from tvist_plant.user_file import UserFileError
from tvist_protocol.calibration import calibration_to_json
from tvist_server.assembly import check_together
from tvist_server.config import ServeConfig, from_mapping
from tvist_server.moving.servo_lag import ServoLag
from tvist_server.option_values import MAX_ROBOTS, StartError, read_start_file, recording_of, robots_in
from tvist_server.profiles import UR_START


def config(**values) -> ServeConfig:
    return from_mapping({"calibration": "none", **values}, "tvist.toml")


def sentence(action, *arguments):
    with pytest.raises(StartError) as caught:
        action(*arguments)
    text = str(caught.value)
    assert "\n" not in text
    return text


@pytest.mark.parametrize(
    ("values", "named"),
    [
        ({"shapper": "zv"}, "shapper"),
        *(({"payload": payload}, "payload") for payload in (-1.0, float("nan"), "5 kg")),
        *(({"speed": speed}, "speed") for speed in (0.0, 1000.0)),
        *(({"seed": seed}, "seed") for seed in (-1, 1.5)),
        *(({"name": name}, "name") for name in ("UR 5", "a/b")),
        *(({"workers": workers}, "workers") for workers in (0, 257)),
        ({"clock": "real"}, "clock"),
        ({"listen": "tcp/127.0.0.1:7447"}, "listen"),
        ({"start": [0, "x"]}, "start"),
        ({"truth": "yes"}, "truth"),
        ({"profile": "urzim"}, "profile"),
        ({"robots": "ur5e*2", "name": "ur5e"}, "robots and name exclude each other"),
        ({"robots": "ur5e*2", "robot": "ur5e"}, "robots and robot exclude each other"),
    ],
)
def test_an_unknown_key_or_invalid_value_is_refused_with_its_key(values, named):
    text = sentence(lambda: config(**values))
    assert text.startswith("tvist.toml: ")
    assert named in text


@pytest.mark.parametrize(
    ("values", "named"),
    [
        ({"shaper": "zvdddd"}, "did you mean 'zvddd'"),
        ({"robot": "ur55"}, "robot 'ur55'"),
        ({"start": "Q9"}, "start is 'Q9': must be one of Q1, Q2, Q3"),
        ({"start": "1,2,three"}, "start"),
        ({"start": "1,2,3"}, "start has 3 angles"),
        ({"start": "0,0,0,0,0,7"}, "q[5]"),
        ({"start": "0,0,0,0,0,nan"}, "q[5]"),
        ({"start": "0,0,0,0,0,0"}, "at q = [0, 0, 0, 0, 0, 0] wrist_2 and floor would overlap by"),
        ({"start": [0.0, 0.0]}, "start has 2 angles"),
        ({"calibration": "nowhere.json"}, "calibration 'nowhere.json'"),
        ({"calibration": "no\0where"}, "null"),
        *(({"robots": text}, "a robot is missing") for text in ("", "ur5e,", "*3")),
        *(({"robots": text}, repr(text)) for text in ("ur5e*", "ur5e*0", "ur5e*1.5", "ur5e*2*2", "ur5e*²")),
        ({"robots": "ur5e*65"}, "from 1 to 64"),
        ({"robots": "ur5e*40,ur5e*40"}, "at most 64"),
        ({"robots": "My Robot.toml"}, "My Robot.toml"),
        ({"robots": "ur5e*2,ur5e-1.toml"}, "ur5e-1"),
    ],
)
def test_a_value_that_contradicts_others_is_refused(values, named):
    assert named in sentence(lambda: config(**values).setups())


def test_robots_are_named_after_their_files_and_numbered_if_there_are_several():
    def names(text):
        return [name for _, name in robots_in(text)]

    assert names("ur5e") == names("ur5e*1") == ["ur5e"]
    assert names("ur5e*2,/a/b/other.toml") == ["ur5e-1", "ur5e-2", "other"]
    assert names("ur5e, other.toml*2 ,ur5e") == ["ur5e-1", "other-1", "other-2", "ur5e-2"]
    assert [robot for robot, _ in robots_in("ur5e,x/other.toml*2")] == ["ur5e", *2 * ["x/other.toml"]]
    assert len(robots_in(f"ur5e*{MAX_ROBOTS}")) == MAX_ROBOTS


def test_each_robot_has_its_own_seed_and_recording():
    setups = from_mapping({"robots": "ur5e*3", "seed": 7, "shaper": "ei", "truth": True}, "").setups()
    assert [(setup.name, setup.seed) for setup in setups] == [("ur5e-1", 7), ("ur5e-2", 8), ("ur5e-3", 9)]
    assert all(setup.shaper == "ei" and setup.truth for setup in setups)
    assert str(recording_of("a.b/out.mcap", "ur5e-3")) == "a.b/out-ur5e-3.mcap"
    assert str(recording_of("out", "other")) == "out-other"


def test_a_folder_that_does_not_exist_is_refused_at_the_start(tmp_path):
    (tmp_path / "file").touch()
    for key, folder in (("dump", "file"), ("dump", "nowhere"), ("programs", "nowhere")):
        text = sentence(check_together, config(**{key: str(tmp_path / folder)}), 1)
        assert f"{key} is '{tmp_path / folder}': must be a folder" in text
    assert config(dump=str(tmp_path)).dump_folder() == tmp_path


@pytest.mark.parametrize(("robot", "name"), [("ur5e", "ur5e_5kg"), ("one-joint", "one-joint_1kg")])
def test_the_default_calibration_belongs_to_the_robot(robot, name):
    made = from_mapping({"robot": robot}, "tvist.toml").setup()
    assert made.calibration.name == name
    assert made.calibration.robot == made.description.robot.model
    assert made.source().fits_arm


def test_a_given_calibration_replaces_the_default(tmp_path):
    file = tmp_path / "mine.json"
    own = msgspec.structs.replace(calibrations.load("one-joint_1kg"), name="mine")
    file.write_bytes(calibration_to_json(own))
    assert config(robot="one-joint", calibration=str(file)).setup().calibration == own


def test_a_robot_without_a_calibration_is_refused_with_the_next_step(tmp_path):
    file = tmp_path / "mine.toml"
    shipped = (resources.files("tvist_plant") / "robots" / "one-joint.toml").read_text("utf-8")
    file.write_text(shipped.replace('"one-joint arm"', '"mine"'), encoding="utf-8")
    next_step = "give one that tvist identify made, or none"
    said = sentence(from_mapping({"robot": str(file)}, "tvist.toml").setup)
    assert said == f"no calibration for a mine comes with the package: {next_step}"
    assert config(robot=str(file)).setup().calibration is None


@pytest.mark.parametrize("start", [" 0.1, -1,2,0,0,0.5", [0.1, -1, 2, 0, 0, 0.5]])
def test_the_start_can_be_given_as_joint_angles(start):
    assert config(start=start).setup().q == (0.1, -1.0, 2.0, 0.0, 0.0, 0.5)


def test_inertia_scales_with_the_given_payload_mass():
    payload = config(payload=2.5).setup().payload
    assert (payload.mass, payload.com) == (2.5, UR5E.payload.com)
    assert payload.inertia == pytest.approx([value / 2.0 for value in UR5E.payload.inertia])


def test_a_payload_above_the_rating_needs_overload(tmp_path):
    said = sentence(config(payload=20.0).setup)
    assert said == "payload is 20 kg, above the ur5e's rating of 5 kg: give --overload to insist"
    assert config(payload=5.0).setup().payload.mass == 5.0
    assert config(payload=20.0, overload=True).setup().payload.mass == 20.0
    text = (resources.files("tvist_plant") / "robots" / "ur5e.toml").read_text(encoding="utf-8")
    path = tmp_path / "heavy.toml"
    path.write_text(text.replace("mass    = 5.0", "mass    = 7.5"), encoding="utf-8")
    assert "payload is 7.5 kg" in sentence(config(robot=str(path)).setup)
    assert config(robot=str(path), payload=4.0).setup().payload.mass == 4.0


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (calibration_to_json(calibration(robot="UR10e")), "UR10e"),
        *((content, "mine.json") for content in (b"", b"{}", b"\xff", b'{"name": "x", "colour": 1}')),
    ],
)
def test_an_invalid_calibration_or_one_of_another_model_is_refused(tmp_path, content, said):
    path = tmp_path / "mine.json"
    path.write_bytes(content)
    assert said in sentence(config(calibration=str(path)).setup)


def test_an_unreadable_or_invalid_file_is_refused_with_its_path(tmp_path):
    assert "nowhere.toml" in sentence(read_start_file, "nowhere.toml", "configuration", dict)
    broken = tmp_path / "broken.toml"
    broken.write_text("name = ")
    assert "broken.toml" in sentence(read_start_file, broken, "configuration", dict)
    for key in ("robot", "state", "calibration"):
        with pytest.raises(UserFileError, match=f"{key}.*{tmp_path} is a directory"):
            config(**{key: str(tmp_path)}).setup()


def test_a_setup_is_restored_from_its_recording_only_if_it_is_complete():
    made = setup(calibration=calibration(), seed=3, truth=True, shaper="ei")
    assert Setup.from_builtins(made.to_builtins()) == made
    for missing in ("description", "q", "payload", "calibration", "seed"):
        content = made.to_builtins()
        del content[missing]
        with pytest.raises(ValueError, match=missing):
            Setup.from_builtins(content)


STATE = """
q = [0.0, -1.5, 1.5, 0.0, 0.0, 0.0]
mode = "POWER_OFF"
shaper = "ei"
seed = 3

[payload]
mass = 20
com = [0.0, 0.0, 0.05]
inertia = [0.01, 0, 0, 0.01, 0, 0.01]
"""


@pytest.mark.parametrize("name", ["state.toml", "state.json"])
def test_a_state_file_overrides_start_shaper_and_profile(tmp_path, name):
    """The carried payload may exceed the rating."""
    file = tmp_path / name
    content = tomllib.loads(STATE)
    file.write_text(json.dumps(content) if name.endswith("json") else STATE)
    found = config(state=str(file), shaper="zv", start="Q1").setup()
    assert (found.q, found.mode, found.shaper, found.seed) == (tuple(content["q"]), "POWER_OFF", "ei", 3)
    assert found.carried.mass == 20.0
    assert found.payload.mass == 5.0
    assert Setup.from_builtins(found.to_builtins()) == found
    profiled = config(ur=True, state=str(file)).setup()
    assert (profiled.q, profiled.shaper, profiled.payload.mass) == (found.q, "ei", 0.0)


@pytest.mark.parametrize(
    ("content", "named"),
    [
        ("q = [0, 0]", "start has 2 angles"),
        ("q = [0, 0, 0, 0, 0, 9]", "start q[5] is 9"),
        ('mode = "BOOTING"', "mode"),
        ("speed = 1", "speed"),
        ("q = ", "state"),
        ('shaper = "zvdddd"', "did you mean 'zvddd'"),
        ("[payload]\nmass = 1\ncom = [0, 0, 0]\ninertia = [1, 0, 0, 1, 0, 9]", "payload.inertia"),
        ("[payload]\nmass = -1\ncom = [0, 0, 0]\ninertia = [1, 0, 0, 1, 0, 1]", "payload.mass"),
    ],
)
def test_an_invalid_state_file_is_refused_with_its_key(tmp_path, content, named):
    file = tmp_path / "state.toml"
    file.write_text(content)
    assert named in sentence(config(state=str(file)).setup)


def test_without_a_temporary_folder_dumps_go_to_the_working_directory(monkeypatch, tmp_path):
    def none():
        raise FileNotFoundError

    monkeypatch.setattr("tempfile.gettempdir", none)
    monkeypatch.chdir(tmp_path)
    assert ServeConfig().dump_folder() == tmp_path


@pytest.mark.parametrize(
    ("values", "lag"),
    [({}, (0.05, 900.0)), ({"servo_lag": "0.1,400"}, (0.1, 400.0)), ({"calibration": "none"}, None)],
)
def test_the_servo_lag_is_that_of_the_calibration_unless_given(tmp_path, values, lag):
    file = tmp_path / "mine.json"
    known = msgspec.structs.replace(calibration(), robot="UR5e", servo_lag_s=0.05, servo_gain=900.0)
    file.write_bytes(calibration_to_json(known))
    given = {"calibration": str(file), "shaper": "none", "enable_motion": True, "plant": "ur://127.0.0.1"}
    assert config(**(given | values)).setup().plant.maker.keywords["lag"] == (lag and ServoLag(*lag))


def test_without_a_profile_defaults_are_those_of_the_paper():
    made, shipped = ServeConfig().setup(), load("ur5e")
    assert ServeConfig().profile_in_force is None
    assert made.description == shipped
    assert (made.q, made.payload, made.carried) == (shipped.poses["Q1"], paper_payload(shipped), None)
    assert (made.name, made.shaper, made.seed, made.clock, made.truth) == ("ur5e", "zv", 0, "realtime", False)
    assert (made.compensate_sag, made.shape_servo) == (False, False)


@pytest.mark.parametrize("options", [{"ur": True}, {"profile": "ursim"}])
def test_ur_interfaces_select_the_profile_ursim(options):
    made = config(**options).setup()
    assert made.q == UR_START
    assert made.payload.mass == 0.0
    assert made.carried is None
    assert (made.shaper, made.compensate_sag, made.shape_servo) == ("none", True, False)
    assert made.description == UR5E.quiet().without_floor()


def test_the_profile_real_changes_only_the_start_posture():
    made = config(ur=True, profile="real").setup()
    assert made.q == UR_START
    assert made.to_builtins() | {"q": None} == config().setup().to_builtins() | {"q": None}


@pytest.mark.parametrize("profile", ["ursim", "real"])
@pytest.mark.parametrize("on", [False, True])
def test_explicit_options_take_precedence(profile, on):
    switches = dict.fromkeys(("quiet", "floor", "compensate_sag"), on)
    made = config(profile=profile, payload=2.0, start="Q3", shaper="ei", **switches).setup()
    assert (made.payload.mass, made.q, made.shaper) == (2.0, UR5E.poses["Q3"], "ei")
    assert made.description.sensors == (UR5E.quiet() if on else UR5E).sensors
    assert made.description.collision == (UR5E if on else UR5E.without_floor()).collision
    assert made.compensate_sag is on


def test_an_arm_without_ur_geometry_starts_in_its_own_posture():
    made = from_mapping({"robot": "one-joint", "ur": True}, "tvist.toml").setup()
    assert made.q == load("one-joint").poses["Q1"]
    assert made.payload.mass == 0.0
    assert [is_of_ur_form(arm) for arm in (UR5E, cut(5), load("one-joint"))] == [True, False, False]


def test_a_robot_file_may_have_no_floor(tmp_path):
    text = (resources.files("tvist_plant") / "robots" / "ur5e.toml").read_text(encoding="utf-8")
    path = tmp_path / "hanging.toml"
    path.write_text(text.replace("floor  = 0.0 ", "has_floor = false\nfloor  = 0.0 "), encoding="utf-8")
    assert config(robot=str(path)).setup().description == UR5E.without_floor()
    assert not config(robot=str(path), floor=True).setup().description.collision.has_floor
