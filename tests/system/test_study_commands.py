"""The commands of studies: one JSON object, the files that are asked for, words for people."""

import json
import re

import numpy as np
import pytest
from tests.system.shell import tvist

from tvist_shaping import SHAPERS, residual
from tvist_shaping.impulse_train import Impulses

MOVE = {
    "start": [1.2, -1.4, 1.5, -1.6, 0.0, 0.0], "target": [0.0, -2.2, 1.9, -1.3, 0.0, 0.0], "payload": 1.5
}  # fmt: skip
FAILS = """from tvist_shaping import zv
calls = []
def later(f_d, zeta):
    calls.append(f_d)
    return zv(f_d, zeta) if len(calls) < 700 else None
"""
"""A shaper that fails between what is tried out and the motion."""
PEEKS = """
past = []


class Memory:
    def reset(self, q):
        past.append([])

    def step(self, q_ref, info):
        past[-1].append(q_ref.copy())
        return past[0][min(len(past[-1]) + 5, len(past[0]) - 1)]
"""


@pytest.fixture
def here(tmp_path):
    (tmp_path / "moves.json").write_text(json.dumps([MOVE]), encoding="utf-8")
    return tmp_path


def test_a_study_of_random_moves_is_written_as_printed_and_reproducible(here, called):
    random = "--moves 2 --seed 5 --clean --save-moves drawn.json --figures . --report report.html"
    again = "--moves drawn.json --disturbances none"
    told, made = (
        called("study", "moves", "--shapers", "auto", *given.split(), "--json").assert_done().json
        for given in (random, again)
    )
    assert told["moves"] == made["moves"]
    for one in (told, made):
        assert [entry["shaper"] for entry in one["summary"]] == ["auto", "waiting"]
        assert (one["arm"], one["disturbances"]) == ("clean", [])
    assert 0.0 < told["free_of_collision"] <= 1.0
    web_page = re.sub(r'"data:[^"]*"', "", (here / "report.html").read_text(encoding="utf-8"))
    assert "(2 moves)" in web_page
    assert not any(word in web_page for word in ("p5", "median", "one of twenty"))
    assert web_page.count("<img") == 2
    assert_drawn(here, "moves.png", "one_move.png")


def assert_drawn(folder, *names):
    """These figures, and no others, are in a folder."""
    assert {path.name for path in folder.iterdir() if path.suffix in {".png", ".svg", ".pdf"}} == set(names)
    assert all((folder / name).stat().st_size > 5000 for name in names)


def test_shapers_are_listed_with_their_properties(here, called):
    told = called("shapers", "--f-d", "6.7", "--zeta", "0.34", "--figures", ".", "--json").assert_done().json
    assert (told["f_d_hz"], told["zeta"]) == (6.7, 0.34)
    listed = {entry["name"]: entry for entry in told["shapers"]}
    assert list(listed) == list(SHAPERS)
    for name, entry in listed.items():
        assert entry["zeta_max"] == SHAPERS[name].zeta_max
        if SHAPERS[name].zeta_max <= 0.34:
            assert "beyond it take" in entry["not_for_this_mode"]
            continue
        impulses = Impulses(np.array(entry["amplitudes"]), np.array(entry["times_s"]))
        assert entry["duration_ms"] == pytest.approx(1000 * impulses.duration)
        assert entry["mean_delay_ms"] == pytest.approx(1000 * impulses.mean_delay)
        for percent in (5, 10):
            for ratio in entry[f"band_{percent}_percent"] or []:
                if ratio is not None:
                    assert residual(6.7 * ratio, 0.34, impulses) == pytest.approx(percent / 100, rel=1e-3)
    assert_drawn(here, "shapers.png", "settling.png")


def test_sensitivity_is_written_as_printed_with_a_band_for_each_shaper(here, called):
    where = "--errors -20 20 --figures . --format pdf --output out.json --json"
    told = called("shapers", "--sensitivity", "zv", "ei", *where.split()).assert_done().json
    curves = {curve["name"]: curve for curve in told["shapers"]}
    assert list(curves) == ["zv", "ei"]
    for curve in curves.values():
        low, high = curve["error_of_5_percent"]
        for error, left in zip(told["error_percent"], curve["residual_percent"], strict=True):
            assert left < 5.01 or not low < error < high
    assert curves["zv"]["residual_percent"][200] == pytest.approx(0.0, abs=1e-9)
    assert_drawn(here, "sensitivity.pdf")
    assert json.loads((here / "out.json").read_text(encoding="utf-8")) == told


def test_shapers_prints_tables_without_json(called):
    said = called("shapers").assert_done().out
    assert all(f"{name} " in said and one.description in said for name, one in SHAPERS.items())
    assert "5 % from" in called("shapers", "--sensitivity").assert_done().out


@pytest.mark.usefixtures("here")
class TestMoves:
    def test_moves_of_a_file_run_with_every_baseline(self, called):
        told = called("study", "moves", "--moves", "moves.json", "--payload", 5, "--json").assert_done().json
        assert [one["shaper"] for one in told["summary"]] == [
            "zv", "waiting", "equal_duration_double_s", "double_s_of_one_period", "zv_frozen_at_end",
            "mzv_for_payload", "ei_for_payload", "ei3_for_payload", "fixed_mzv", "fixed_ei2", "fixed_ei3",
        ]  # fmt: skip
        assert told["disturbances"] == ["friction", "gear", "noise"]
        (mine,) = (move for move in told["moves"] if move["shaper"] == "zv")
        assert 0.0 <= mine["shaped_peak_m_s2"] < mine["unshaped_peak_m_s2"]
        assert mine["payload_kg"] == 1.5

    def test_disturbances_act_separately(self, called):
        told = {
            name: called(
                "study", "moves", "--moves", "moves.json", "--shapers", "auto-target", "--disturbances", name, "--json",
            ).assert_done().json
            for name in ("none", "noise", "friction,gear")
        }  # fmt: skip
        arms = ["clean", "with noise alone", "with friction and gear alone"]
        assert [one["arm"] for one in told.values()] == arms
        assert told["noise"]["moves"] == told["none"]["moves"]  # the truth has no noise
        made = {
            name: next(move for move in one["moves"] if move["shaper"] == "auto-target")
            for name, one in told.items()
        }
        assert made["friction,gear"]["shaped_peak_m_s2"] > made["none"]["shaped_peak_m_s2"]
        assert made["none"]["shaped_peak_m_s2"] < 0.05 * made["none"]["unshaped_peak_m_s2"]

    def test_a_move_beyond_a_joint_limit_is_refused(self, here, called):
        far = [MOVE, {**MOVE, "target": [0, 0, 7, 0, 0, 0]}]
        (here / "moves.json").write_text(json.dumps(far), encoding="utf-8")
        ended = called("study", "moves", "--moves", "moves.json")
        ended.assert_failed(2, "move 2", "joint 3", "elbow", "6.28319")


def test_failed_rows_are_counted_and_the_first_is_named(here, called):
    (here / "mine.py").write_text(FAILS, encoding="utf-8")
    ended = called("study", "moves", "--moves", 1, "--shapers", "mine.py:later", "--json")
    said = "the shaper returns NoneType instead of Impulses(A, tau) of tvist_shaping for f_d = "
    ended.assert_failed(1, "1 of 2 rows failed, the first with later at move 1", said)


@pytest.mark.nightly
def test_bench_does_not_rank_a_shaper_that_uses_future_samples(here):
    (here / "peeks.py").write_text(PEEKS, encoding="utf-8")
    given = "study bench --quick --moves 1 --shapers zv peeks.py --json"
    ended = tvist(*given.split(), cwd=here).assert_failed(1, "not ranked", "uses future samples")
    rows = {row["shaper"]: row for row in ended.json["summary"]}
    assert [rows[name]["ranked"] for name in ("none", "zv", "peeks")] == [True, True, False]
    assert "uses future samples" in rows["peeks"]["fault"]
    arms = list(ended.json["arms"])
    assert {one["arm"] for one in ended.json["by_arm"] if one["shaper"] == "zv"} == set(arms)
    assert (len(arms), arms[-2:]) == (15, ["stiction", "more_stiction"])


def test_a_plant_named_twice_is_simulated_once(called):
    given = "study moves --moves 1 --shapers zv --plants stribeck Stribeck hidden-5 --hidden 5 6 5 --json"
    assert list(called(*given.split()).assert_done().json["arms"]) == ["stribeck", "hidden-5", "hidden-6"]
