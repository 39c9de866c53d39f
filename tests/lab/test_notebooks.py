"""The lessons run from top to bottom, and the answers that they compute are what physics asks for."""

import importlib.util
import math
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

NOTEBOOKS = Path(__file__).parents[2] / "lab" / "notebooks"
BARE = """
import importlib.abc, sys

class OnlyThese(importlib.abc.MetaPathFinder):
    def find_spec(self, name, path, target=None):
        if name.split(".")[0] in {forbidden}:
            raise ImportError(name + " is not there in a browser")

sys.meta_path.insert(0, OnlyThese())
sys.path.insert(0, {folder!r})
import lesson_1_two_impulses
lesson_1_two_impulses.app.run()
"""


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
    assert [path.stem.split("_")[1] for path in lessons] == ["1", "2", "3", "4"]
    ended = subprocess.run(
        [sys.executable, "-m", "marimo", "check", "--strict", *lessons],
        check=False,
        capture_output=True,
        text=True,
    )
    assert ended.returncode == 0, ended.stdout + ended.stderr


@pytest.fixture(scope="module")
def paper():
    return lesson("lesson_3_paper")


@pytest.fixture(scope="module")
def own():
    return lesson("lesson_4_your_shaper")


class TestTwoImpulses:
    NAME = "lesson_1_two_impulses"

    @pytest.mark.parametrize("percent", [5, 10, 20])
    def test_zv_leaves_the_sine_of_the_error_without_damping(self, percent):
        found = lesson(self.NAME, damping=0.0, frequency=7.0, tolerance=percent)["answer"]
        assert found["zv_leaves"] == pytest.approx(math.sin(0.5 * math.pi * percent / 100.0), rel=1e-6)

    def test_the_less_is_known_the_longer_is_the_shortest_shaper_that_will_do(self):
        periods = [lesson(self.NAME, tolerance=percent)["answer"]["periods"] for percent in (0, 10, 30)]
        assert periods[0] == 0.5
        assert periods == sorted(periods)
        assert periods[-1] > 1.0

    def test_where_no_shaper_will_do_it_says_so(self):
        assert lesson(self.NAME, damping=0.0, frequency=7.0, tolerance=90)["answer"]["shortest"] == []

    def test_half_a_period_and_the_decayed_share_leave_nothing(self):
        share = lesson(self.NAME)["zv"].A[0]
        assert share > 0.5
        assert lesson(self.NAME, wait=0.5, share=share)["remaining"] < 1e-12

    def test_the_curve_swings_at_the_damped_frequency_and_overshoots_as_the_formula_says(self):
        module, time = opened(self.NAME), np.linspace(0.0, 1.0, 100_001)
        position = module.step_response(time, 5.0, 0.1)
        peak = int(np.argmax(position))
        assert time[peak] == pytest.approx(0.5 / 5.0, abs=1e-5)
        overshoot = lesson(self.NAME, damping=0.1, frequency=5.0)["overshoot"]
        assert position[peak] - 1.0 == pytest.approx(overshoot, rel=1e-6)

    def test_it_needs_nothing_that_a_browser_lacks(self):
        lacking = {"zenoh", "numba", "pinocchio", "ruckig", "tvist_lab", "tvist_controller", "tvist_plant"}
        code = BARE.format(forbidden=lacking, folder=str(NOTEBOOKS))
        ended = subprocess.run([sys.executable, "-c", code], check=False, capture_output=True, text=True)
        assert ended.returncode == 0, ended.stderr


class TestPoses:
    NAME = "lesson_2_poses"

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


class TestPaper:
    def test_what_the_formula_predicts_of_the_fixed_shaper_is_what_the_arm_does(self, paper):
        assert paper["answer"]["predicted"] == pytest.approx(paper["answer"]["fixed"], abs=0.15)
        assert paper["answer"]["fixed"] > 0.4
        assert paper["answer"]["tvist"] < 0.15

    def test_ours_stands_beside_the_papers_figures(self, paper):
        table = paper["table_2"]
        rows = ["unshaped, paper", "unshaped, here", "shaped, paper", "shaped, here"]
        assert list(table) == rows
        for kind in ("unshaped", "shaped"):
            theirs, ours = (table[f"{kind}, {who}"]["delay_ms"] for who in ("paper", "here"))
            assert ours == pytest.approx(theirs, abs=5.0)
        unshaped = [table[f"unshaped, {who}"]["residual_vibration_m_s2"] for who in ("paper", "here")]
        assert unshaped[1] == pytest.approx(unshaped[0], rel=0.25)


class TestYourShaper:
    def test_the_robust_shaper_leaves_less_at_a_wrong_frequency_and_is_twice_as_long(self, own):
        remaining, delay = own["answer"]["remaining"], own["answer"]["delay_ms"]
        assert remaining["ei", 0.25] < 0.6 * remaining["zv", 0.25]
        assert remaining["zv", 0.0] < remaining["zv", 0.25]
        assert delay["ei"] == pytest.approx(2.0 * delay["zv"], rel=0.1)

    def test_the_mistake_in_the_shaper_to_be_corrected_is_seen(self, own):
        remaining = opened("lesson_4_your_shaper").remaining
        assert remaining(own["tried"]["mine"]) > 2.0 * remaining(own["tried"]["zv"])
