"""What runs are judged by and written to: limits, a baseline, JUnit's XML and a web page."""

import json
from copy import deepcopy
from xml.etree import ElementTree as ET

import pytest
from tests.controller.robots import NoArm
from tests.lab.test_programs import MOVES, run

from tvist_controller.sources.own_plants import OwnPlant
from tvist_lab.programs.judging import BaselineError, broken, changes, read_baseline
from tvist_lab.programs.limits import Limits
from tvist_lab.programs.results import as_dict, junit

UNCOMPILED = {
    "file": "wrong.script",
    "ok": False,
    "exit_reason": "compile_error",
    "error": {"line": 2, "column": 9, "text": "no x"},
    "failures": [{"kind": "compile_error", "line": 2, "text": "no x"}],
}


@pytest.fixture(scope="module")
def watch():
    return run('textmsg("<b>\\x01&")', *MOVES, payload=5.0)


@pytest.fixture
def result(watch):
    return {"file": "a.script", "lockstep": True, "recording": None, "failures": [], **as_dict(watch)}


def kept(path, *results):
    path.write_text(json.dumps(results[0] if len(results) == 1 else {"programs": results}), encoding="utf-8")
    return path


def limits(shake, seconds, joint_speed, tool_speed):
    return Limits(
        max_shake=shake, max_seconds=seconds, max_joint_speed=joint_speed, max_tool_speed=tool_speed
    )


def texts(found):
    return [one.text for one in found]


class TestLimits:
    def test_those_that_are_kept_say_nothing(self, watch):
        assert texts(broken(limits(10.0, 100.0, 3.2, 5.0), watch)) == []
        assert texts(broken(Limits(), watch)) == []

    def test_each_that_is_broken_says_where_and_when(self, watch):
        found = list(broken(limits(0.3, 1.0, 0.5, 0.1), watch))
        assert [one.kind for one in found] == [
            "max_seconds",
            *["max_shake"] * 3,
            "max_joint_speed",
            "max_tool_speed",
        ]
        assert [one.line for one in found[1:4]] == [3, 5, 6]
        assert "s, more than 1 (--max-seconds)" in found[0].text
        assert f"after move 2, which stopped at {watch.moves[1].rests * 0.002:.3f} s" in found[2].text
        assert f"{watch.moves[1].peak:.3g} m/s², more than 0.3 (--max-shake)" in found[2].text
        assert found[4].text.startswith("joint base turned with ")
        assert found[5].text.startswith("the tool moved with ")

    def test_a_shake_that_nobody_knows_breaks_its_limit(self):
        mute = run(MOVES[0], plant=OwnPlant("mine.py:NoArm", "", lambda *_: NoArm()), truth=False)
        (found,) = broken(Limits(max_shake=5.0), mute)
        assert (found.line, "not known" in found.text) == (2, True)


class TestBaseline:
    def test_the_same_run_has_not_changed(self, result, tmp_path):
        path = kept(tmp_path / "base.json", json.loads(json.dumps(result)))
        before = read_baseline(path, ["a.script"])["a.script"]
        assert texts(changes(before, result)) == []
        result["moves"][0]["peak_after_stop_m_s2"] *= 1.0 + 1e-4  # as on another processor
        result["moves"][0]["line"] += 7  # a comment more
        assert texts(changes(before, result)) == []

    @pytest.mark.parametrize(
        ("change", "said"),
        [
            (lambda one: one.update(exit_reason="timeout"), "exit_reason is timeout, before finished"),
            (lambda one: one.update(seconds=one["seconds"] + 0.002), "seconds is "),
            (lambda one: one["moves"].pop(), "the number of moves is 2, before 3"),
            (lambda one: one["moves"][1].update(seconds=9.0), "move 2: seconds is 9, before "),
            (lambda one: one["moves"][1].update(stopped="by hand"), "move 2: stopped is by hand, before nothing"),
            (lambda one: one["moves"][1].update(rested_s=1.0), "move 2: rested_s is 1, before 0.002"),
            (lambda one: one["moves"][1].update(peak_after_stop_m_s2=None), "peak_after_stop_m_s2 is nothing, before "),
            (lambda one: one["largest_joint_speed"].update(speed_rad_s=3.0), "largest joint speed_rad_s is 3, before "),
            (lambda one: one["largest_tool_speed"].update(speed_m_s=3.0), "largest tool speed_m_s is 3, before "),
            (lambda one: one["warnings"].append({"text": "hot"}), "new warning: hot"),
        ],
    )  # fmt: skip
    def test_each_change_is_a_sentence(self, result, tmp_path, change, said):
        before = read_baseline(kept(tmp_path / "base.json", result), ["a.script"])["a.script"]
        change(now := deepcopy(result))
        (found,) = texts(changes(before, now))
        assert said in found

    def test_a_warning_that_is_gone_and_an_error_that_is_new_are_told(self, result, tmp_path):
        result["warnings"] = [{"text": "hot"}]
        before = read_baseline(kept(tmp_path / "base.json", result), ["a.script"])["a.script"]
        assert texts(changes(before, {**result, "warnings": []})) == ["no longer warned: hot"]
        uncompiled = {**UNCOMPILED, "file": "a.script"}
        assert texts(changes(before, uncompiled)) == ["exit_reason is compile_error, before finished"]

    def test_it_may_have_several_programs_in_any_order(self, result, tmp_path):
        found = read_baseline(kept(tmp_path / "b.json", UNCOMPILED, result), ["a.script", "wrong.script"])
        assert found["a.script"]["seconds"] == result["seconds"]
        assert found["wrong.script"]["exit_reason"] == "compile_error"

    @pytest.mark.parametrize(
        ("content", "word"),
        [
            ("", "is not what tvist run --lockstep --json prints"),
            ("[1]", "is not what tvist run"),
            ('{"ok": true}', "is not what tvist run"),
            ('{"programs": 3}', "is not what tvist run"),
            ('{"file": "a.script", "exit_reason": "finished"}', "is not what tvist run"),
            ('{"file": "a.script", "exit_reason": "compile_error", "lockstep": false}', "in real time"),
            ('{"file": "b.script", "exit_reason": "compile_error"}', "is of b.script, and this run is of a"),
            ('{"file": "a.script", "exit_reason": "compile_error", "warnings": "x"}', "is not what tvist run"),
            ('{"programs": []}', "is of nothing"),
            ("[" * 100_000, "is not what tvist run"),
            (f'{{"file": "a.script", "exit_reason": 1{400 * "0"}}}', "is not what tvist run"),
        ],
    )  # fmt: skip
    def test_another_shape_is_refused_in_a_sentence(self, tmp_path, content, word):
        (tmp_path / "base.json").write_text(content, encoding="utf-8")
        with pytest.raises(BaselineError, match=word) as refused:
            read_baseline(tmp_path / "base.json", ["a.script"])
        assert "base.json" in str(refused.value)


def test_junit_has_a_case_for_each_program_with_measures_and_sentences(result):
    result["failures"] = [
        {"kind": "max_shake", "line": 3, "text": "shook"},
        {"kind": "baseline", "line": None, "text": "x"},
    ]
    result |= {"ok": False, "warnings": [{"timestamp": 0.1, "line": 4, "text": "slow\ufffe"}]}
    suites = ET.fromstring(junit([result, UNCOMPILED, {**result, "ok": True, "failures": []}]))  # noqa: S314  our own
    (suite,) = suites
    assert (suites.get("tests"), suite.get("failures")) == ("3", "2")
    bad, wrong, good = suite
    assert [case.get("name") for case in suite] == ["a.script", "wrong.script", "a.script"]
    assert float(bad.get("time")) == pytest.approx(result["seconds"], abs=1e-3)
    measures = {one.get("name"): float(one.get("value")) for one in bad.find("properties")}
    assert measures["largest_peak_after_stop_m_s2"] == pytest.approx(
        result["largest_peak_after_stop_m_s2"], rel=1e-4
    )
    assert {"seconds", "moves", "largest_joint_speed_rad_s", "largest_tool_speed_m_s"} <= measures.keys()
    failure = bad.find("failure")
    assert (failure.get("type"), failure.get("message")) == ("max_shake", "shook; x")
    assert failure.text == "a.script:3: shook\nx"
    assert wrong.find("failure").text == "wrong.script:2: no x"
    assert good.find("failure") is None
    assert "<b>" in good.find("system-out").text
    assert good.find("system-err").text == "a.script:4: slow\N{REPLACEMENT CHARACTER}"
