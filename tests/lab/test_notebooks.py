"""The lessons run from top to bottom, and the answers that they compute are what physics asks for."""

import importlib.util
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest

NOTEBOOKS = Path(__file__).parents[2] / "lab" / "notebooks"


def opened(name):
    spec = importlib.util.spec_from_file_location(name, NOTEBOOKS / f"{name}.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def lesson(name, **values):
    """What a notebook computes, with its controls as they stand or as they are set."""
    controls = {control: SimpleNamespace(value=value) for control, value in values.items()}
    return opened(name).app.run(defs=controls)[1]


@pytest.fixture(scope="module", autouse=True)
def marimo():
    return pytest.importorskip("marimo")


def test_marimo_accepts_every_lesson():
    lessons = sorted(NOTEBOOKS.glob("*.py"))
    assert [path.stem.split("_")[1] for path in lessons] == ["1", "2"]
    check = [sys.executable, "-m", "marimo", "check", "--strict", *lessons]
    ended = subprocess.run(check, check=False, capture_output=True, text=True)
    assert ended.returncode == 0, ended.stdout + ended.stderr


def test_folded_arm_vibrates_faster_and_longer_than_a_stretched_one():
    stretched = lesson("lesson_1_poses", shoulder=-180, elbow=0, wrist=-90)
    folded = lesson("lesson_1_poses", shoulder=-90, elbow=150, wrist=-90)
    assert stretched["here_f"] == pytest.approx(6.7, rel=0.05)
    assert folded["here_f"] == pytest.approx(15.0, rel=0.05)
    assert folded["here_zeta"] < 0.5 * stretched["here_zeta"]
    # No single frequency serves the workspace by ZV; the best one is no worse than the one on the slider.
    answer = folded["answer"]
    assert folded["spread_f"].min() < answer["design_hz"] < folded["spread_f"].max()
    assert 0.3 < answer["worst"] < 1.0
    assert answer["worst"] <= folded["left"].max()


def test_most_robust_shaper_has_more_than_twice_the_delay():
    answer = lesson("lesson_1_poses", chosen="ei3", design=12.0)["answer"]
    assert answer["worst"] < 0.1
    assert answer["fixed_ms"] > 2.0 * answer["following_ms"]


def test_robust_shaper_leaves_less_at_a_wrong_frequency():
    own = lesson("lesson_2_your_shaper")
    remaining, delay = own["answer"]["remaining"], own["answer"]["delay_ms"]
    assert remaining["ei", 0.25] < 0.6 * remaining["zv", 0.25]
    assert remaining["zv", 0.0] < remaining["zv", 0.25]
    assert delay["ei"] == pytest.approx(2.0 * delay["zv"], rel=0.1)
    measure = opened("lesson_2_your_shaper").remaining
    assert measure(own["tried"]["mine"]) > 2.0 * measure(own["tried"]["zv"])
