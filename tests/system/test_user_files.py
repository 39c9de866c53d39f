"""Files that `tvist serve` is given and that are not what is asked for: one sentence, exit code 1, at once."""

import os
from importlib import resources
from pathlib import Path

import pytest
from tests.conformance.served import refused_to_start

URDF = Path(__file__).parents[1] / "plant" / "urdf" / "seven.urdf"
OPTIONS = ("--robot", "--config", "--state", "--calibration")


@pytest.mark.parametrize("option", OPTIONS)
@pytest.mark.parametrize(
    ("path", "kind"), [("/dev/zero", "a device"), ("pipe", "a pipe"), (".", "a directory")]
)
def test_what_is_no_file_is_a_failure(option, path, kind, tmp_path):
    os.mkfifo(tmp_path / "pipe")
    code, said = refused_to_start(option, tmp_path / path)  # an absolute path stays what it is
    assert code == 1
    assert str(tmp_path / path) in said
    assert kind in said


@pytest.mark.parametrize("option", OPTIONS[:3])
@pytest.mark.parametrize(
    "text",
    [f"poses = {'[' * 100_000}", f"poses = {'{a=' * 100_000}", f"poses{'.a' * 100_000} = 1"],
    ids=["arrays", "inline tables", "dotted key"],
)
def test_one_that_is_nested_too_deeply_is_a_failure(option, text, tmp_path):
    path = tmp_path / "deep.toml"
    path.write_text(text)
    code, said = refused_to_start(option, path)
    assert code == 1
    assert f"{path} is nested too deeply" in said


def test_so_are_roles(tmp_path):
    (tmp_path / "clients.toml").write_text(f"x = {'[' * 100_000}")
    code, said = refused_to_start("--security", tmp_path, endpoint="tls/127.0.0.1:0")
    assert code == 1
    assert "clients.toml is nested too deeply" in said


def test_a_robot_file_in_degrees_is_a_failure(tmp_path):
    path = tmp_path / "degrees.toml"
    text = (resources.files("tvist_plant") / "robots" / "ur5e.toml").read_text(encoding="utf-8")
    path.write_text(text.replace("6.283185307179586", "360.0"))
    code, said = refused_to_start("--robot", path)
    assert code == 1
    assert "limits.position[0] is 360 rad" in said
    assert "degrees" in said


@pytest.mark.parametrize(
    ("name", "old", "new", "said"),
    [
        ("mine.toml", "[27500.0,", "[-27500.0,", "drives.gear_stiffness[0] is -27500.0: must be more than 0"),
        ("mine.urdf", '<mass value="2.7"/>', '<mass value="0"/>', "link elbow has no <inertial> with a mass"),
        (
            "mine.urdf",
            '<parent link="wrist"/>',
            '<parent link="elbow"/>',
            "the chain branches after link elbow",
        ),
    ],
)
def test_an_arm_that_cannot_be_simulated_is_a_failure(name, old, new, said, tmp_path):
    path = tmp_path / name
    shipped = resources.files("tvist_plant") / "robots" / "ur5e.toml"
    text = shipped.read_text(encoding="utf-8") if name.endswith(".toml") else URDF.read_text(encoding="utf-8")
    assert old in text
    path.write_text(text.replace(old, new), encoding="utf-8")
    code, told = refused_to_start("--robot", path)
    assert code == 1
    assert said in told
