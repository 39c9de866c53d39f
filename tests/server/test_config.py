"""Configuration: what is wrong is said in one sentence that names the key."""

import json
import tomllib
from importlib import resources

import msgspec
import pytest
from tests.controller.robots import Q1, Q3, UR5E, calibration, cut, setup

from tvist_controller.setup import Setup, paper_payload
from tvist_controller.sources import calibrations
from tvist_plant.user_file import UserFileError
from tvist_protocol.calibration import calibration_to_json
from tvist_server.config import ServeConfig, from_mapping
from tvist_server.moving.servo_lag import ServoLag
from tvist_server.option_values import StartError, read_start_file


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
        ({"payload": -1.0}, "payload"),
        ({"payload": float("nan")}, "payload"),
        ({"payload": "5 kg"}, "payload"),
        ({"speed": 0.0}, "speed"),
        ({"speed": 1000.0}, "speed"),
        ({"seed": -1}, "seed"),
        ({"seed": 1.5}, "seed"),
        ({"name": "UR 5"}, "name"),
        ({"name": "a/b"}, "name"),
        ({"clock": "real"}, "clock"),
        ({"listen": "tcp/127.0.0.1:7447"}, "listen"),
        ({"start": [0, "x"]}, "start"),
        ({"truth": "yes"}, "truth"),
    ],
)
def test_a_key_or_value_that_cannot_be(values, named):
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
    ],
)
def test_what_does_not_fit_the_rest(values, named):
    assert named in sentence(config(**values).setup)


def test_a_folder_for_the_last_second_that_is_none_is_refused_and_not_found_out_at_the_failure(tmp_path):
    (tmp_path / "file").touch()
    for folder in ("file", "nowhere"):
        assert f"dump is '{tmp_path / folder}': must be a folder" in sentence(
            config(dump=str(tmp_path / folder)).dump_folder
        )
    assert config(dump=str(tmp_path)).dump_folder() == tmp_path


def test_the_defaults_are_the_paper_s():
    made = config().setup()
    assert made.q == UR5E.poses["Q1"]
    assert made.payload == paper_payload(UR5E)
    assert (made.name, made.shaper, made.seed, made.clock, made.truth) == ("ur5e", "zv", 0, "realtime", False)


def test_without_calibration_the_estimator_is_fixed():
    made = config(calibration="none").setup()
    assert made.calibration is None
    f_d, zeta = made.estimator().estimate(Q1)
    assert (f_d.tolist(), zeta.tolist()) == ([10.0], [0.2])


@pytest.mark.parametrize(("robot", "name"), [("ur5e", "ur5e_5kg"), ("one-joint", "one-joint_1kg")])
def test_the_default_calibration_belongs_to_the_robot(robot, name):
    made = from_mapping({"robot": robot}, "tvist.toml").setup()
    assert made.calibration.name == name
    assert made.calibration.robot == made.description.robot.model
    assert made.source().fits_arm


def test_a_calibration_that_is_named_takes_the_place_of_the_default(tmp_path):
    file = tmp_path / "mine.json"
    own = msgspec.structs.replace(calibrations.load("one-joint_1kg"), name="mine")
    file.write_bytes(calibration_to_json(own))
    assert config(robot="one-joint", calibration=str(file)).setup().calibration == own


def test_a_robot_that_no_calibration_belongs_to_says_what_to_do(tmp_path):
    file = tmp_path / "mine.toml"
    shipped = (resources.files("tvist_plant") / "robots" / "one-joint.toml").read_text("utf-8")
    file.write_text(shipped.replace('"one-joint arm"', '"mine"'), encoding="utf-8")
    said = sentence(from_mapping({"robot": str(file)}, "tvist.toml").setup)
    assert said == (
        "no calibration for a mine comes with the package: give one that tvist identify made, or none"
    )
    assert config(robot=str(file)).setup().calibration is None


@pytest.mark.parametrize("start", ["0.1,-1,2,0,0,0.5", " 0.1, -1, 2, 0, 0, 0.5", [0.1, -1, 2, 0, 0, 0.5]])
def test_a_start_by_its_angles(start):
    assert config(start=start).setup().q == (0.1, -1.0, 2.0, 0.0, 0.0, 0.5)


def test_a_start_by_its_name():
    assert config(start="Q3").setup().q == tuple(Q3)


@pytest.mark.parametrize("mass", [0.0, 2.5])
def test_another_payload_is_the_same_disc_in_less_steel(mass):
    payload = config(payload=mass).setup().payload
    assert payload.mass == mass
    assert payload.com == UR5E.payload.com
    assert payload.inertia == pytest.approx([value * mass / 5.0 for value in UR5E.payload.inertia])


def test_a_payload_above_the_rating_is_refused_and_says_how_to_insist():
    assert sentence(config(payload=20.0).setup) == (
        "payload is 20 kg, above the ur5e's rating of 5 kg: give --overload to insist"
    )
    assert config(payload=5.0).setup().payload.mass == 5.0
    assert config(payload=20.0, overload=True).setup().payload.mass == 20.0


def test_the_payload_of_a_robot_file_is_declared_too(tmp_path):
    text = (resources.files("tvist_plant") / "robots" / "ur5e.toml").read_text(encoding="utf-8")
    path = tmp_path / "heavy.toml"
    path.write_text(text.replace("mass    = 5.0", "mass    = 7.5"), encoding="utf-8")
    assert "payload is 7.5 kg" in sentence(config(robot=str(path)).setup)
    assert config(robot=str(path), payload=4.0).setup().payload.mass == 4.0


def test_what_is_carried_may_be_above_the_rating(tmp_path):
    file = tmp_path / "state.toml"
    file.write_text(STATE.replace("mass = 1.5", "mass = 20"))
    assert config(state=str(file)).setup().carried.mass == 20.0


def test_a_calibration_file(tmp_path):
    path = tmp_path / "mine.json"
    path.write_bytes(calibration_to_json(calibration(name="mine")))
    assert config(calibration=str(path)).setup().calibration.name == "mine"


def test_a_calibration_of_another_robot(tmp_path):
    path = tmp_path / "other.json"
    path.write_bytes(calibration_to_json(calibration(robot="UR10e")))
    text = sentence(config(calibration=str(path)).setup)
    assert "UR10e" in text
    assert "UR5e" in text


@pytest.mark.parametrize("content", [b"", b"{}", b"\xff", b'{"name": "x", "colour": 1}'])
def test_a_broken_calibration_file_is_named(tmp_path, content):
    path = tmp_path / "broken.json"
    path.write_bytes(content)
    assert str(path) in sentence(config(calibration=str(path)).setup)


def test_a_file_that_cannot_be_read_or_is_no_toml(tmp_path):
    assert "nowhere.toml" in sentence(read_start_file, "nowhere.toml", "configuration", dict)
    broken = tmp_path / "broken.toml"
    broken.write_text("name = ")
    assert "broken.toml" in sentence(read_start_file, broken, "configuration", dict)


@pytest.mark.parametrize("key", ["robot", "state", "calibration"])
def test_a_file_that_is_none_is_not_taken_for_a_wrong_value(key, tmp_path):
    with pytest.raises(UserFileError, match=f"{key}.*{tmp_path} is a directory"):
        config(**{key: str(tmp_path)}).setup()


def test_a_file_is_read(tmp_path):
    path = tmp_path / "tvist.toml"
    path.write_text('shaper = "ei"\nseed = 7\nlisten = ["tcp/0.0.0.0:7447"]\n')
    read = from_mapping(read_start_file(path, "configuration", dict), str(path))
    assert (read.shaper, read.seed, read.listen) == ("ei", 7, ("tcp/0.0.0.0:7447",))


@pytest.mark.parametrize("own", [None, calibration()])
def test_a_setup_comes_back_from_its_recording(own):
    made = setup(calibration=own, seed=3, truth=True, shaper="ei")
    assert Setup.from_builtins(made.to_builtins()) == made


@pytest.mark.parametrize("missing", ["description", "q", "payload", "calibration", "seed"])
def test_a_recording_s_start_that_lacks_a_part(missing):
    content = setup().to_builtins()
    del content[missing]
    with pytest.raises(ValueError, match=missing):
        Setup.from_builtins(content)


@pytest.mark.parametrize("joints", [1, 2, 5, 6])
def test_a_setup_of_any_number_of_joints_is_checked_for_that_number(joints):
    description = cut(joints)
    setup(description).check()
    with pytest.raises(ValueError, match=f"{joints} joints"):
        setup(description, q=(0.0,) * (joints + 1)).check()


STATE = """
q = [0.0, -1.5, 1.5, 0.0, 0.0, 0.0]
mode = "POWER_OFF"
shaper = "ei"
seed = 3

[payload]
mass = 1.5
com = [0.0, 0.0, 0.05]
inertia = [0.01, 0, 0, 0.01, 0, 0.01]
"""


@pytest.mark.parametrize("name", ["state.toml", "state.json"])
def test_a_state_to_start_in_goes_before_the_rest(tmp_path, name):
    file = tmp_path / name
    content = tomllib.loads(STATE)
    file.write_text(json.dumps(content) if name.endswith("json") else STATE)
    found = config(state=str(file), shaper="zv", start="Q1").setup()
    assert (found.q, found.mode, found.shaper, found.seed) == (tuple(content["q"]), "POWER_OFF", "ei", 3)
    assert found.carried.mass == 1.5
    assert found.payload.mass == 5.0
    assert Setup.from_builtins(found.to_builtins()) == found


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
def test_a_state_that_cannot_be(tmp_path, content, named):
    file = tmp_path / "state.toml"
    file.write_text(content)
    assert named in sentence(config(state=str(file)).setup)


def test_a_state_that_is_not_there(tmp_path):
    assert "No such file" in sentence(config(state=str(tmp_path / "no.toml")).setup)


def test_a_machine_without_a_temporary_folder_serves_all_the_same(monkeypatch, tmp_path):
    def none():
        raise FileNotFoundError

    monkeypatch.setattr("tempfile.gettempdir", none)
    monkeypatch.chdir(tmp_path)
    assert ServeConfig().dump_folder() == tmp_path


@pytest.mark.parametrize(
    ("values", "lag"),
    [
        ({}, (0.05, 900.0)),
        ({"servo_lag": "0.1,400"}, (0.1, 400.0)),
        ({"calibration": "none"}, None),
    ],
)
def test_the_servo_of_a_robot_that_is_moved_is_the_calibrations_unless_another_is_given(
    tmp_path, values, lag
):
    file = tmp_path / "mine.json"
    known = msgspec.structs.replace(calibration(), robot="UR5e", servo_lag_s=0.05, servo_gain=900.0)
    file.write_bytes(calibration_to_json(known))
    given = {
        "calibration": str(file),
        "shaper": "none",
        "enable_motion": True,
        "plant": "ur://127.0.0.1",
    } | values
    moved = config(**given)
    assert moved.setup().plant.maker.keywords["lag"] == (lag and ServoLag(*lag))
