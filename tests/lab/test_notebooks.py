"""The lessons run from top to bottom, and the answers that they compute are what physics asks for."""

import importlib.util
import subprocess
import sys
from pathlib import Path

import pytest

NOTEBOOKS = Path(__file__).parents[2] / "lab" / "notebooks"


def opened(name):
    spec = importlib.util.spec_from_file_location(name, NOTEBOOKS / f"{name}.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def lesson(name, **values):
    """What a notebook computes, with its controls as they stand or as they are set."""
    controls = {control: FixedControl(value) for control, value in values.items()}
    return opened(name).app.run(defs=controls)[1]


class FixedControl:
    def __init__(self, value):
        self.value = value


@pytest.fixture(scope="module", autouse=True)
def marimo():
    return pytest.importorskip("marimo")


def test_every_lesson_is_a_notebook_that_marimo_has_nothing_to_say_about():
    lessons = sorted(NOTEBOOKS.glob("*.py"))
    assert [path.stem.split("_")[1] for path in lessons] == ["1", "2"]
    ended = subprocess.run(
        [sys.executable, "-m", "marimo", "check", "--strict", *lessons],
        check=False,
        capture_output=True,
        text=True,
    )
    assert ended.returncode == 0, ended.stdout + ended.stderr


@pytest.fixture(scope="module")
def own():
    return lesson("lesson_2_your_shaper")


class TestPoses:
    NAME = "lesson_1_poses"

    def test_a_folded_arm_swings_faster_and_longer_than_a_stretched_one(self):
        stretched = lesson(self.NAME, shoulder=-180, elbow=0, wrist=-90)
        folded = lesson(self.NAME, shoulder=-90, elbow=150, wrist=-90)
        assert stretched["here_f"] == pytest.approx(6.7, rel=0.05)
        assert folded["here_f"] == pytest.approx(15.0, rel=0.05)
        assert folded["here_zeta"] < 0.5 * stretched["here_zeta"]

    def test_no_single_frequency_serves_the_workspace_by_zv(self):
        found = lesson(self.NAME)
        answer = found["answer"]
        assert found["spread_f"].min() < answer["design_hz"] < found["spread_f"].max()
        assert 0.3 < answer["worst"] < 1.0
        # The best single frequency is no worse than the one on the slider.
        assert answer["worst"] <= found["left"].max()

    def test_the_most_robust_shaper_covers_it_for_more_than_twice_the_delay(self):
        answer = lesson(self.NAME, chosen="ei3", design=12.0)["answer"]
        assert answer["worst"] < 0.1
        assert answer["fixed_ms"] > 2.0 * answer["following_ms"]


class TestYourShaper:
    def test_the_robust_shaper_leaves_less_at_a_wrong_frequency_and_is_twice_as_long(self, own):
        remaining, delay = own["answer"]["remaining"], own["answer"]["delay_ms"]
        assert remaining["ei", 0.25] < 0.6 * remaining["zv", 0.25]
        assert remaining["zv", 0.0] < remaining["zv", 0.25]
        assert delay["ei"] == pytest.approx(2.0 * delay["zv"], rel=0.1)

    def test_the_mistake_in_the_shaper_to_be_corrected_is_seen(self, own):
        remaining = opened("lesson_2_your_shaper").remaining
        assert remaining(own["tried"]["mine"]) > 2.0 * remaining(own["tried"]["zv"])
