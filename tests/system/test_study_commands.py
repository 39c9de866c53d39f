"""The commands of studies from a shell: seconds, one JSON object, the files that are asked for, words for people."""

import json
import re

import numpy as np
import pytest
from tests.system.test_command_line import tvist

from tvist_cli.simulated_arm import plants_of
from tvist_plant.description import load
from tvist_shaping import SHAPERS, residual
from tvist_shaping.impulse_train import Impulses

MOVES = [
    {"start": [0.0, -2.2, 1.9, -1.3, 0.0, 0.0], "target": [1.2, -1.4, 1.5, -1.6, 0.0, 0.0]},
    {"start": [1.2, -1.4, 1.5, -1.6, 0.0, 0.0], "target": [0.0, -2.2, 1.9, -1.3, 0.0, 0.0], "payload": 1.5},
]
PEEKS = """
past = []


class Memory:
    def reset(self, q):
        past.append([])

    def step(self, q_ref, info):
        past[-1].append(q_ref.copy())
        return past[0][min(len(past[-1]) + 5, len(past[0]) - 1)]
"""


def made_again(told, folder):
    """Random moves are kept, and can be made again."""
    again = ["--disturbances", "none", "--shaper", "auto", "--no-baselines", "--json"]
    made = tvist("evaluate", "--moves", folder / "drawn.json", *again).assert_done().json
    assert told["moves"] == made["moves"]
    assert told["baselines"] == {}
    for one in (told, made):
        assert (one["plant"], one["disturbances"]) == ("clean", [])
    assert 0.0 < told["free_of_collision"] <= 1.0
    web_page = re.sub(r'"data:[^"]*"', "", (folder / "report.html").read_text(encoding="utf-8"))
    assert "(2 moves)" in web_page
    assert not any(word in web_page for word in ("p5", "median", "one of twenty"))


def as_they_are(told, _):
    """Every shaper is listed as it is."""
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


def with_bands(told, _):
    """There is a curve of each shaper, and its band."""
    curves = {curve["name"]: curve for curve in told["shapers"]}
    assert list(curves) == ["zv", "ei"]
    for curve in curves.values():
        low, high = curve["error_of_5_percent"]
        for error, left in zip(told["error_percent"], curve["residual_percent"], strict=True):
            assert left < 5.01 or not low < error < high
    assert curves["zv"]["residual_percent"][200] == pytest.approx(0.0, abs=1e-9)


def with_each_error(told, _):
    """Each shaper has its reductions with each error."""
    (zv,) = told["shapers"]
    assert (zv["name"], told["moves"], told["calibration"]) == ("zv", 1, "ur5e_modal")
    assert zv["stiffness"].keys() > zv["payload"].keys() > {"+0 %", "+20 %", "-20 %"}


def pair_by_pair(told, _):
    """Each plant has the medians of both, and a verdict; the seed is said to be for tuning."""
    assert (told["shapers"], told["moves"], told["payload_kg"]) == (["zv", "ei"], 20, [0.0, 3.0])
    assert [one["name"] for one in told["plants"]] == ["calibrated", "hidden-3"]
    for one in told["plants"]:
        assert one["first"]["delay_ms"] < one["second"]["delay_ms"]
        assert one["verdict"] in {"first", "second", "no difference shown", "too few moves vibrate"}
    assert "not held out" in told["held_out"]


RANDOM = "evaluate --random 2 --seed 5 --payload uniform --clean --shaper auto --no-baselines --save-moves drawn.json"
RUNS = {
    "evaluate": (f"{RANDOM} --figures . --report report.html", {"moves.png", "one_move.png"}, made_again),
    "robustness": (
        "study robustness --moves 1 --against zv --output out.json --figures .",
        {"robustness.png"},
        with_each_error,
    ),
    "match": (
        "study match zv ei --moves 20 --plants calibrated --hidden 3 --payload 0 3 --clean --output out.json",
        set(),
        pair_by_pair,
    ),
    "shapers": (
        "shapers --f-d 6.7 --zeta 0.34 --figures .",
        {"shapers.png", "settling.png"},
        as_they_are,
    ),
    "sensitivity": (
        "shapers --sensitivity zv ei --errors -20 20 --figures . --format pdf --output out.json",
        {"sensitivity.pdf"},
        with_bands,
    ),
}
"""Commands, the figures that they write, and what is asked of their results."""
SAID = {
    "shapers": ([f"{name} " for name in SHAPERS] + [one.description for one in SHAPERS.values()], []),
    "shapers --sensitivity": (["5 % from"], []),
}  # fmt: skip
"""Commands with words that they print for people, and those about their run."""


@pytest.fixture
def here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "moves.json").write_text(json.dumps(MOVES), encoding="utf-8")
    return tmp_path


@pytest.mark.parametrize("name", RUNS)
def test_a_result_is_right_and_what_is_written_is_what_is_printed(here, name):
    words, figures, check = RUNS[name]
    told = tvist(*words.split(), "--json").assert_done().json
    check(told, here)
    assert {path.name for path in here.iterdir() if path.suffix in {".png", ".svg", ".pdf"}} == figures
    assert all((here / figure).stat().st_size > 5000 for figure in figures)
    if "--output" in words:
        assert json.loads((here / "out.json").read_text(encoding="utf-8")) == told
    if "--report" in words:
        assert (here / "report.html").read_text(encoding="utf-8").count("<img") == len(figures)


@pytest.mark.parametrize("words", SAID)
@pytest.mark.usefixtures("here")
def test_words_are_for_people(words):
    ended = tvist(*words.split()).assert_done()
    printed, about = SAID[words]
    assert [word for word in printed if word not in ended.out] == []
    assert [word for word in about if word not in ended.err] == []


@pytest.mark.usefixtures("here")
class TestEvaluate:
    def test_moves_of_a_file_have_the_keys_that_are_promised(self):
        told = tvist("evaluate", "--moves", "moves.json", "--payload", 5, "--json").assert_done().json
        assert list(told["baselines"]) == [
            "waiting", "equal_duration_double_s", "double_s_of_one_period", "zv_frozen_at_end",
            "mzv_for_payload", "ei_for_payload", "ei3_for_payload", "fixed_mzv", "fixed_ei2", "fixed_ei3",
        ]  # fmt: skip
        assert told["disturbances"] == ["friction", "gear", "noise"]
        assert len(told["moves"]) == 2
        for move in told["moves"]:
            assert {
                "unshaped_peak_m_s2", "shaped_peak_m_s2", "reduction_percent", "delay_ms", "still_after_ms",
                "peak_acceleration_ratio", "peak_velocity_ratio",
            } <= set(move)  # fmt: skip
            assert set(move["still_after_ms"]) == {"unshaped", "shaped"}
            assert 0.0 <= move["shaped_peak_m_s2"] < move["unshaped_peak_m_s2"]
        assert [move["payload_kg"] for move in told["moves"]] == [5.0, 1.5]
        assert set(told["reduction_percent"]) == {"median", "p5", "min"}
        assert set(told["delay_ms"]) == {"median", "max"}
        assert set(told["peak_acceleration_ratio"]) == {"median", "p90", "max"}

    def test_words_are_for_people_with_what_they_should_know(self, here):
        (here / "moves.json").write_text(json.dumps(MOVES[1:]), encoding="utf-8")
        said = tvist("evaluate", "--moves", "moves.json", "--payload", 5).assert_done()
        assert "unshaped m/s²" in said.out
        assert "fixed_ei3" in said.out
        assert "carry something else" in said.err

    def test_disturbances_act_one_by_one_and_the_targets_knower_is_a_shaper_like_any(self):
        told = {
            name: tvist(
                "evaluate", "--moves", "moves.json", "--shaper", "auto-target", "--disturbances", name,
                "--no-baselines", "--json",
            ).assert_done().json
            for name in ("none", "noise", "friction,gear")
        }  # fmt: skip
        assert [one["plant"] for one in told.values()] == [
            "clean", "with noise alone", "with friction and gear alone"
        ]  # fmt: skip
        assert told["noise"]["moves"] == told["none"]["moves"]  # the truth has no noise
        assert told["friction,gear"]["peak_m_s2"]["median"] > told["none"]["peak_m_s2"]["median"]
        assert told["none"]["reduction_percent"]["min"] > 95.0

    def test_a_move_beyond_a_limit_is_named(self, here):
        far = [MOVES[0], {**MOVES[0], "target": [0, 0, 7, 0, 0, 0]}]
        (here / "moves.json").write_text(json.dumps(far), encoding="utf-8")
        tvist("evaluate", "--moves", "moves.json").assert_failed(2, "move 2", "joint 3", "elbow", "6.28319")


def test_shaperbench_names_a_cheat_and_does_not_rank_it(here):
    (here / "peeks.py").write_text(PEEKS, encoding="utf-8")
    given = [
        "--quick",
        "--moves",
        "1",
        "--against",
        "zv",
        "--shaper",
        "peeks.py",
        "--output",
        "board.json",
        "--json",
    ]
    ended = tvist("shaperbench", *given).assert_failed(1, "not ranked", "peeks at the future")
    rows = {row["name"]: row for row in ended.json["shapers"]}
    assert [rows[name]["ranked"] for name in ("none", "zv", "peeks")] == [True, True, False]
    assert "peeks at the future" in rows["peeks"]["fault"]
    assert json.loads((here / "board.json").read_text(encoding="utf-8")) == ended.json
    assert set(rows["zv"]["by_arm"]) == set(ended.json["arms"])
    assert len(ended.json["arms"]) == 15
    assert list(ended.json["arms"])[-2:] == ["stiction", "more_stiction"]


def test_a_plant_that_is_named_twice_counts_once():
    names = [one.name for one in plants_of(["stribeck", "Stribeck", "hidden-5"], [5, 6, 5], load("ur5e"))]
    assert names == ["stribeck", "hidden-5", "hidden-6"]
