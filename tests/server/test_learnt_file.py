"""The file of learnt motions: what is written is read again, and what is not whole is refused in a sentence."""

import json
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st
from msgspec.structs import replace as changed

from tvist_controller.experience.motion_student import LearntMotion
from tvist_controller.line.correction import BUMPS
from tvist_lab.in_process import free_setup
from tvist_server.assembly import made_robot
from tvist_server.config import ConfigError, ServeConfig
from tvist_server.learnt_file import LearntFile, LearntFileError

SETUP = free_setup()
ONE = LearntMotion(
    move="0123456789abcdef", begins=700, bumps=((0.1, -0.2, 0.0),) * BUMPS, first=0.4, best=0.1
)


def written(path):
    LearntFile(path, SETUP).write([ONE])
    return json.loads(path.read_text())


def test_what_is_written_is_read_again(tmp_path):
    path = tmp_path / "moves.json"
    assert LearntFile(path, SETUP).motions == ()
    written(path)
    assert LearntFile(path, SETUP).motions == (ONE,)
    assert [one.name for one in tmp_path.iterdir()] == ["moves.json"]


def test_a_robot_takes_what_it_learnt_in_an_earlier_run_before_its_first_tick(tmp_path):
    path = tmp_path / "moves.json"
    written(path)
    robot = made_robot(
        free_setup(clock="lockstep"), ServeConfig(learn=str(path), clock="lockstep"), None, several=False
    )
    assert robot.controller.cycle.corrections.forget()
    robot.close()


@pytest.mark.parametrize(
    ("change", "why"),
    [
        ({"robot": "0" * 16}, "other links, springs or drives"),
        ({"version": 2}, "version"),
        ({"motions": [{}]}, "motions"),
        ({"more": 1}, "more"),
    ],
)
def test_a_file_of_another_kind_is_refused_in_a_sentence(tmp_path, change, why):
    path = tmp_path / "moves.json"
    path.write_text(json.dumps(written(path) | change))
    with pytest.raises(LearntFileError, match=why):
        LearntFile(path, SETUP)


def test_another_calibration_begins_anew_and_says_so(tmp_path):
    path = tmp_path / "moves.json"
    path.write_text(json.dumps(written(path) | {"calibration": "0" * 16}))
    file = LearntFile(path, SETUP)
    assert (file.motions, "learnt anew" in file.ignored) == ((), True)


def test_a_folder_that_is_missing_is_refused(tmp_path):
    config = ServeConfig(learn=str(tmp_path / "none" / "moves.json"))
    with pytest.raises(ConfigError, match="there is no folder"):
        made_robot(SETUP, config, None, several=False)


def test_a_name_that_no_file_can_have_is_refused(tmp_path):
    with pytest.raises(LearntFileError, match="name too long"):
        LearntFile(tmp_path / ("long" * 100), SETUP)


@given(
    number=st.integers(0, 30),
    value=st.floats(allow_nan=True) | st.integers() | st.text(max_size=3) | st.none(),
)
def test_a_changed_value_is_within_its_bounds_or_refused(tmp_path_factory, number, value):
    path = tmp_path_factory.mktemp("learnt") / "moves.json"
    content = written(path)
    motion = content["motions"][0]
    names = [*motion]
    if number < len(names):
        motion[names[number]] = value
    else:
        motion["bumps"][number % BUMPS][number % 3] = value
    path.write_text(json.dumps(content))
    try:
        (read,) = LearntFile(path, SETUP).motions
    except LearntFileError:
        pass
    else:
        assert 1 <= read.begins <= 100_000
        assert all(abs(height) <= 10.0 for bump in read.bumps for height in bump)
        assert 0.0 <= read.best <= 1e3


def test_motions_of_another_robot_file_are_not_those_of_this_one(tmp_path):
    path = tmp_path / "moves.json"
    written(path)
    drives = changed(SETUP.description.drives, gear_stiffness=(1e4,) * 6)
    other = replace(SETUP, description=changed(SETUP.description, drives=drives))
    with pytest.raises(LearntFileError, match="give this robot a file of its own"):
        LearntFile(path, other)


def test_what_cannot_be_written_is_told_once_and_learning_goes_on(tmp_path):
    folder, told = tmp_path / "gone", []
    folder.mkdir()
    keep = LearntFile(folder / "moves.json", SETUP).keeper(told.append)
    folder.rmdir()
    keep([ONE])
    keep([ONE])
    assert len(told) == 1
    assert "cannot be written" in told[0]
    folder.mkdir()
    keep([ONE])
    assert LearntFile(folder / "moves.json", SETUP).motions == (ONE,)
