"""Figures of `tvist bench` beside their references: intervals, saved runs and their comparison."""

import math

import msgspec
import numpy as np
import pytest

from tvist_lab.benchmark.figure import figure, in_alternation, median_interval
from tvist_lab.benchmark.machine import this_machine
from tvist_lab.benchmark.saved_run import FORMAT, BenchRun, as_json, changes, load_run
from tvist_plant.user_file import UserFileError


def run(**figures):
    return BenchRun(format=FORMAT, seconds=1.0, machine=this_machine(), figures=figures)


def ratio(*values):
    return figure("a tick", "µs", values, "another tick", [1.0] * len(values))


def test_the_interval_of_a_median_holds_it_as_often_as_it_says():
    chance = np.random.default_rng(0)
    held = [
        low <= 0.0 <= high for _, low, high in (median_interval(chance.normal(size=20)) for _ in range(2000))
    ]
    assert 0.95 <= np.mean(held) <= 0.98  # order statistics hold it a little more often


def test_a_ratio_is_that_of_each_repetition_so_that_a_drift_of_the_machine_cancels_out():
    drift = np.linspace(1.0, 3.0, 20)
    one = figure("ours", "µs", 0.5 * drift, "theirs", drift)
    assert (one.compared, one.low, one.high) == (0.5, 0.5, 0.5)


def test_no_ratio_to_nothing_but_a_difference():
    assert figure("ours", "", [1.0, 2.0], "theirs", [0.0, 0.0]).compared is None
    assert figure("ours", "", [1.0, 2.0], "theirs", [0.0, 0.0], "difference").compared == 1.5


def test_repetitions_alternate_forwards_and_backwards_after_a_first_one_that_does_not_count():
    order = []
    taken = in_alternation({name: lambda name=name: order.append(name) or len(order) for name in "ab"}, 2)
    assert "".join(order) == "ababba"
    assert taken == {"a": [3, 6], "b": [4, 5]}


def test_a_saved_run_is_read_as_it_was(tmp_path):
    saved, path = run(line=ratio(1.0, 2.0, 3.0)), tmp_path / "run.json"
    path.write_bytes(msgspec.json.encode(as_json(saved)))
    assert load_run(path) == saved
    assert as_json(saved)["line"] == 2.0


@pytest.mark.parametrize("content", ["", "no", "[]", "{}", '{"format": "tvist bench 0"}'])
def test_another_file_is_refused(tmp_path, content):
    path = tmp_path / "run.json"
    path.write_text(content, encoding="utf-8")
    with pytest.raises(UserFileError, match="is not a run that"):
        load_run(path)


def test_the_change_is_the_ratio_of_the_ratios_with_an_interval_of_both():
    old, new = ratio(0.9, 1.0, 1.1), ratio(0.45, 0.5, 0.55)
    (one,) = changes(run(line=old), run(line=new))
    assert one.change == pytest.approx(0.5)
    half = math.hypot(math.log(0.5 / 0.45), math.log(1.1))
    assert one.low == pytest.approx(0.5 * math.exp(-half))
    assert one.beyond


def test_a_change_within_the_intervals_is_not_beyond_them():
    (one,) = changes(run(line=ratio(0.9, 1.0, 1.1)), run(line=ratio(0.85, 0.95, 1.05)))
    assert one.beyond is False
    (alone,) = changes(run(line=ratio(1.0)), run(line=ratio(2.0)))
    assert (alone.change, alone.beyond) == (2.0, None)


def test_a_figure_of_one_run_only_is_told():
    found = {one.key: one for one in changes(run(old=ratio(1.0)), run(new=ratio(1.0)))}
    assert found["old"].new is None
    assert found["new"].old is None
