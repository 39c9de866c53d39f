"""Several robots by one option: which they are, what they are called, and what is wrong in one sentence."""

import importlib.resources

import pytest

from tvist_server.config import from_mapping
from tvist_server.option_values import MOST, StartError, members, recording_of


def names(text):
    return [member.name for member in members(text)]


def test_one_has_the_name_of_its_file_and_several_have_numbers():
    assert names("ur5e") == ["ur5e"]
    assert names("ur5e*1") == ["ur5e"]
    assert names("ur5e*3") == ["ur5e-1", "ur5e-2", "ur5e-3"]
    assert names("ur5e*2,/a/b/other.toml") == ["ur5e-1", "ur5e-2", "other"]
    assert names("ur5e, other.toml*2 ,ur5e") == ["ur5e-1", "other-1", "other-2", "ur5e-2"]
    assert [member.robot for member in members("ur5e,x/other.toml*2")] == [
        "ur5e",
        "x/other.toml",
        "x/other.toml",
    ]


def test_as_many_as_there_may_be():
    assert len(members(f"ur5e*{MOST}")) == MOST
    assert len(members(",".join(["ur5e"] * MOST))) == MOST


@pytest.mark.parametrize(
    ("text", "named"),
    [
        ("", "a robot is missing"),
        ("ur5e,", "a robot is missing"),
        ("*3", "a robot is missing"),
        ("ur5e*", "'ur5e*'"),
        ("ur5e*0", "'ur5e*0'"),
        ("ur5e*x", "'ur5e*x'"),
        ("ur5e*-1", "'ur5e*-1'"),
        ("ur5e*1.5", "'ur5e*1.5'"),
        ("ur5e*2*2", "'ur5e*2*2'"),
        ("ur5e*²", "'ur5e*²'"),
        ("ur5e*65", "from 1 to 64"),
        ("ur5e*99999999999999999999", "from 1 to 64"),
        ("ur5e*40,ur5e*40", "at most 64"),
        ("My Robot.toml", "My Robot.toml"),
        ("ur5e*2,ur5e-1.toml", "ur5e-1"),
    ],
)
def test_what_is_wrong_is_one_sentence_and_a_fault_of_the_configuration(text, named):
    with pytest.raises(StartError) as caught:
        from_mapping({"robots": text}, "tvist.toml").setups()
    sentence = str(caught.value)
    assert sentence.startswith("robots ")
    assert named in sentence
    assert "\n" not in sentence


@pytest.mark.parametrize("key", ["name", "robot"])
def test_robots_exclude_what_is_said_of_one(key):
    with pytest.raises(StartError, match=f"tvist.toml: robots and {key} exclude each other"):
        from_mapping({"robots": "ur5e*2", key: "ur5e"}, "tvist.toml")


def test_a_robot_that_is_not_there_is_named():
    with pytest.raises(StartError, match="nope"):
        from_mapping({"robots": "ur5e,nope"}, "tvist.toml").setups()


def test_each_has_a_seed_of_its_own_and_everything_else_in_common():
    setups = from_mapping({"robots": "ur5e*3", "seed": 7, "shaper": "ei", "truth": True}, "").setups()
    assert [(setup.name, setup.seed) for setup in setups] == [("ur5e-1", 7), ("ur5e-2", 8), ("ur5e-3", 9)]
    assert all(setup.shaper == "ei" and setup.truth for setup in setups)


def test_robots_of_different_files_start_each_from_its_own(tmp_path):
    own = importlib.resources.files("tvist_plant").joinpath("robots", "ur5e.toml").read_text("utf-8")
    (tmp_path / "other.toml").write_text(own, encoding="utf-8")
    setups = from_mapping({"robots": f"ur5e*2,{tmp_path}/other.toml"}, "").setups()
    assert [setup.name for setup in setups] == ["ur5e-1", "ur5e-2", "other"]


def test_without_robots_there_is_one():
    (setup,) = from_mapping({"name": "mine"}, "").setups()
    assert setup.name == "mine"


def test_each_of_several_is_recorded_into_a_file_with_its_name():
    assert str(recording_of("a.b/out.mcap", "ur5e-3")) == "a.b/out-ur5e-3.mcap"
    assert str(recording_of("out", "other")) == "out-other"
