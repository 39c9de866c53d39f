"""Benchmarks: their statistics, and that each figure has its reference."""

import json

import numpy as np
import pytest
from benchmarks.__main__ import main
from benchmarks.figure import figure, in_alternation, median_interval
from benchmarks.lateness import compared, mean_interval


def test_median_interval_has_its_coverage():
    drawn = np.random.default_rng(0).normal(size=(2000, 20))
    held = [low <= 0.0 <= high for _, low, high in map(median_interval, drawn)]
    assert 0.95 <= np.mean(held) <= 0.98  # order statistics hold it a little more often


def test_drift_of_the_machine_cancels_out_of_a_ratio():
    drift = np.linspace(1.0, 3.0, 20)
    one = figure("ours", "µs", 0.5 * drift, "theirs", drift)
    assert (one.compared, one.low, one.high) == (0.5, 0.5, 0.5)


def test_there_is_no_ratio_to_zero():
    assert figure("ours", "", [1.0, 2.0], "theirs", [0.0, 0.0]).compared is None


def test_repetitions_alternate_after_a_warm_up():
    order = []
    taken = in_alternation({name: lambda name=name: order.append(name) or len(order) for name in "ab"}, 2)
    assert "".join(order) == "ababba"
    assert taken == {"a": [3, 6], "b": [4, 5]}


@pytest.mark.parametrize(("often", "ticks"), [(0.02, 1.0), (0.3, 5.0)])
def test_mean_interval_of_rare_misses_has_its_coverage(often, ticks):
    chance, held = np.random.default_rng(0), []
    for _ in range(60):
        missed = 0.05 * chance.poisson(often, 200) * chance.geometric(1.0 / ticks, 200)
        low, high = mean_interval(missed, 0.05)
        held.append(low <= 0.05 * often * ticks <= high)
    assert np.mean(held) >= 0.85


def test_mean_interval_of_zeros_follows_the_rule_of_three():
    low, high = mean_interval([0.0] * 300, 0.05)
    assert -low == pytest.approx(high)
    assert high == pytest.approx(0.05 * 3 / 300, rel=0.01)


def test_robot_and_thread_are_compared_by_the_mean_of_pairs():
    found = compared([(0.2, 0.1), (0.1, 0.1)], 4.0)
    assert found["pairs"] == 2
    assert (found["robot_percent"], found["bare_percent"]) == pytest.approx((0.15, 0.1))
    assert found["difference_points"] == pytest.approx(0.05)
    assert found["lower_end_points"] <= 0.05 <= found["upper_end_points"]


@pytest.mark.parametrize(
    ("words", "why"),
    [(["--only", "lines"], "invalid choice: 'lines'"), (["--seconds", "-1"], "is -1: must be 0 to 86400")],
)
def test_invalid_arguments_are_refused(words, why, capsys):
    with pytest.raises(SystemExit) as ended:
        main(words)
    assert ended.value.code == 2
    assert why in capsys.readouterr().err


@pytest.fixture
def _few(monkeypatch):
    """Repeat measurements only twice, which shows that they work."""
    few = {
        "line.REPETITIONS": 2, "programs.PAIRS": 2, "programs.COMPILED": 2, "served.OF_READER": 2, "served.OF_RTDE": 2,
    }  # fmt: skip
    for name, number in few.items():
        monkeypatch.setattr(f"benchmarks.{name}", number)


@pytest.mark.nightly
@pytest.mark.usefixtures("_few")
def test_each_computed_figure_has_its_reference(capsys):
    main(["--seconds", "0", "--json"])
    said = json.loads(capsys.readouterr().out)
    assert {"plant_us_per_tick", "filter_us_per_tick", "line_us_per_tick", "realtime_factor"} <= said.keys()
    for key, one in said["figures"].items():
        assert one["value"] == said[key] > 0.0
        assert one["low"] <= one["compared"] <= one["high"]


@pytest.mark.nightly
@pytest.mark.realtime
@pytest.mark.usefixtures("_few")
@pytest.mark.parametrize("part", ["reader", "rtde", "lateness", "bridge"])
def test_served_parts_measure_something(part, capsys):
    main(["--only", part, "--seconds", "2", "--json"])
    said = json.loads(capsys.readouterr().out)
    assert said["figures"] or said[part]
