"""A run of a program: how it ends, what it says, how it moves and shakes, and what it is judged by."""

import json
from copy import deepcopy
from dataclasses import replace
from xml.etree import ElementTree as ET

import numpy as np
import pytest
from tests.controller.robots import NoArm
from tests.own_arm import STANDS, OwnArm

from tvist_controller.sources.own_plants import OwnPlant
from tvist_lab.in_process import free_setup
from tvist_lab.metrics import amplitude, motions, tool_acceleration
from tvist_lab.programs.judging import BaselineError, broken, changes, read_baseline
from tvist_lab.programs.limits import RunLimits
from tvist_lab.programs.results import as_dict, junit, largest_peak
from tvist_lab.programs.running import run_in_lockstep
from tvist_lab.recordings.mcap_file import read
from tvist_lab.replay import replay_file
from tvist_protocol.errors import RefusedError
from tvist_server.option_values import StartError

THERE, BACK = "[-1.2, -1.5, -2.0, -0.8, 1.6, 0]", "[-1.6, -1.7, -2.2, -0.8, 1.6, 0]"
MOVES = (f"movej({THERE}, a=3, v=2)", "sleep(0.5)", f"movej({BACK}, a=3, v=2)", f"movej({THERE}, a=3, v=2)")


def script(*lines, kind="def"):
    return "\n".join((f"{kind} prog():", *(f"  {line}" for line in lines), "end", ""))


def run(*lines, inputs=(), timeout=100.0, record=None, kind="def", plant=None, **changes):
    setup = replace(free_setup(profile="ursim", **changes), plant=plant)
    how = {"record": record, "timeout": timeout, "attend": lambda _: None, "on_record_error": pytest.fail}
    return run_in_lockstep(setup, script(*lines, kind=kind), inputs, **how)


def test_a_completed_program_is_reported_as_finished_with_its_duration():
    watch = run("sleep(0.3)", 'textmsg("slept")', "sleep(0.2)")
    assert (watch.name, watch.reason, watch.why) == ("prog", "finished", None)
    assert watch.seconds == pytest.approx(0.5)
    assert [(one.tick, one.text) for one in watch.said] == [(151, "slept")]


@pytest.mark.parametrize(
    ("lines", "how", "reason", "why", "told"),
    [
        (['textmsg("beside")'], {"kind": "sec"}, "finished", "", ["beside"]),
        (["halt", 'textmsg("never")'], {}, "finished", "", []),
        (["movel(p[3, 0, 0.5, 0, 0, 0])", 'textmsg("never")'], {}, "protective_stop",
         "no joint positions reach this pose", []),
        (['rtde_set_watchdog("input_int_register_0", 10)', "while True:", "sync()", "end"], {}, "paused",
         "nobody can resume", ["input_int_register_0"]),
        (["while True:", "sync()", "end"], {"timeout": 0.4}, "timeout", "after 0.4 s of robot time", []),
    ],
)  # fmt: skip
def test_run_reports_how_and_why_it_ended(lines, how, reason, why, told):
    watch = run(*lines, **how)
    assert (watch.reason, why in (watch.why or "")) == (reason, True)
    assert watch.seconds == pytest.approx(how.get("timeout", watch.seconds))
    heard = [one.text for one in watch.said]
    assert all(words in text for words, text in zip(told, heard, strict=True))


def test_popups_are_reported_and_do_not_block_the_program():
    watch = run('popup("part?", title="Ask", error=True, blocking=True)', 'textmsg("on")')
    assert [(one.kind, one.text, one.title, one.level) for one in watch.said] == [
        ("popup", "part?", "Ask", "error"), ("text", "on", None, None),
    ]  # fmt: skip


def test_inputs_are_set_from_the_first_tick():
    watch = run(
        "textmsg(read_input_integer_register(3))",
        "textmsg(read_input_float_register(0))",
        "textmsg(read_input_boolean_register(70))",
        "textmsg(get_standard_digital_in(2))",
        inputs=(
            "input_int_register_3 = -7", "input_double_register_0=0.5", "input_bit_register_70=true",
            "digital_input_2=on",
        ),
    )  # fmt: skip
    assert [one.text for one in watch.said] == ["-7", "0.5", "True", "True"]


def test_moves_have_durations_and_are_marked_if_stopped():
    watch = run(*MOVES, "speedj([0.2, 0, 0, 0, 0, 0], 2, 0.3)")
    planned = watch.moves[:3]
    assert len(watch.moves) == 4
    assert [move.stopped for move in planned] == [None, None, None]
    assert [move.started for move in planned] == sorted(move.started for move in planned)
    assert all(0.3 < (move.ended - move.started) * 0.002 < 2.0 for move in planned)
    assert watch.moves[3].stopped is not None
    assert watch.tick >= watch.moves[-1].ended + 150  # until the arm rests


def test_stop_without_rest_has_the_peak_predicted_at_rest():
    quick, slow = (run(*MOVES[:3], *pause, *MOVES[3:], payload=5.0) for pause in ((), ("sleep(0.5)",)))
    assert quick.moves[1].rested < 50 < slow.moves[1].rested
    assert quick.moves[1].peak == pytest.approx(slow.moves[1].peak, rel=0.005)
    assert quick.moves[2].peak != pytest.approx(slow.moves[2].peak, rel=1e-6)  # it began while the tool shook


def test_stop_before_an_abrupt_motion_has_the_peak_predicted_at_rest():
    jolt, rest = "speedj([0.2, 0, 0, 0, 0, 0], 2, 0.3)", "sleep(0.5)"
    quick, slow = (run(MOVES[0], *pause, jolt, payload=5.0, shaper="auto") for pause in ((), (rest,)))
    assert quick.moves[0].peak == pytest.approx(slow.moves[0].peak, abs=0.003)


def test_moves_and_warnings_have_program_lines():
    up = "movel(pose_trans(get_target_tcp_pose(), p[0, 0, 0.1, 0, 0, 0]), a=30, v=9)"
    watch = run("sleep(0.1)", up, MOVES[0])
    assert [move.line for move in watch.moves] == [3, 4]
    assert [(said.kind, said.line) for said in watch.said] == [("warning", 3)]
    assert watch.fastest_joint.line in {3, 4}


def test_peak_equals_that_of_the_recorded_truth(tmp_path):
    path = tmp_path / "run.mcap"
    watch = run(*MOVES, payload=5.0, record=path)
    recording = read(path).recording
    alpha = amplitude(tool_acceleration(recording, truth=True))
    for move in (watch.moves[0], watch.moves[2]):
        rows = slice(recording.index(move.ended + 5), recording.index(move.ended + 151))
        assert move.peak == pytest.approx(np.max(alpha[rows]), rel=1e-6)
    assert [motion.stopped for motion in motions(recording)] == [False] * 3


def test_recording_of_a_program_replays_exactly(tmp_path):
    path = tmp_path / "run.mcap"
    run(*MOVES, 'popup("on?", blocking=True)', inputs=("digital_input_1=1",), record=path)
    again = replay_file(read(path))
    assert again.first_difference is None
    assert [event.kind for event in again.events] == [event.kind for event in read(path).events]


def test_refused_program_leaves_no_recording(tmp_path):
    with pytest.raises(RefusedError, match="script_error"):
        run("nope()", record=tmp_path / "run.mcap")
    assert list(tmp_path.iterdir()) == []


def test_result_as_values_is_complete():
    watch = run('textmsg("a")', 'popup("b", title="c")', *MOVES[:2], "y = 1 / 0")
    told = as_dict(watch)
    assert (told["ok"], told["exit_reason"], told["program"]) == (False, "runtime_error", "prog")
    assert (told["error"]["line"], told["warnings"]) == (6, [])
    assert told["messages"] == [
        {"timestamp": 0.002, "kind": "text", "text": "a"},
        {"timestamp": 0.002, "kind": "popup", "text": "b", "title": "c", "level": "message"},
    ]
    (move,) = told["moves"]
    assert move["peak_after_stop_m_s2"] == told["largest_peak_after_stop_m_s2"] > 0.0
    assert 0.3 < move["seconds"] < told["seconds"]
    assert (move["line"], move["rested_s"]) == (4, None)
    joint, tool = told["largest_joint_speed"], told["largest_tool_speed"]
    assert joint["joint"] == "base"
    assert 0.5 < joint["speed_rad_s"] < 2.0
    assert tool["line"] == joint["line"] == 4


def test_pacing_plant_is_refused_and_without_truth_the_peak_is_unknown_and_breaks_its_limit():
    watch = run(MOVES[0], plant=OwnPlant("mine.py:NoArm", "", lambda *_: NoArm()), truth=False)
    assert (watch.reason, len(watch.moves), largest_peak(watch)) == ("finished", 1, None)
    (found,) = broken(RunLimits(max_shake=5.0), watch)
    assert (found.line, "not known" in found.text) == (2, True)
    with pytest.raises(StartError, match="the plant OwnArm gives the tick"):
        run(MOVES[0], plant=OwnPlant("mine.py:OwnArm", "", OwnArm), truth=False)
    with pytest.raises(StartError, match="which is no plant"):
        run(MOVES[0], plant=OwnPlant("mine.py:nothing", "", lambda *_: None), truth=False)


def test_recording_starts_at_the_pose_of_the_arm(tmp_path):
    class Stands(OwnArm):
        wait = None  # it does not give the tick

    path = tmp_path / "run.mcap"
    run("sleep(0.1)", plant=OwnPlant("mine.py:Stands", "", Stands), truth=False, record=path)
    assert read(path).start["q"] == STANDS.tolist()


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


def texts(found):
    return [one.text for one in found]


class TestLimits:
    def test_kept_limits_give_no_failure(self, watch):
        most = RunLimits(max_shake=10.0, max_seconds=100.0, max_joint_speed=3.2, max_tool_speed=5.0)
        assert texts(broken(most, watch)) == texts(broken(RunLimits(), watch)) == []

    def test_broken_limit_is_reported_with_line_and_time(self, watch):
        most = RunLimits(max_shake=0.3, max_seconds=1.0, max_joint_speed=0.5, max_tool_speed=0.1)
        found = list(broken(most, watch))
        kinds = ["max_seconds", *["max_shake"] * 3, "max_joint_speed", "max_tool_speed"]
        assert [one.kind for one in found] == kinds
        assert [one.line for one in found[1:4]] == [3, 5, 6]
        assert "s, more than 1 (--max-seconds)" in found[0].text
        assert f"after move 2, which stopped at {watch.moves[1].rests * 0.002:.3f} s" in found[2].text
        assert f"{watch.moves[1].peak:.3g} m/s², more than 0.3 (--max-shake)" in found[2].text
        assert found[4].text.startswith("joint base turned with ")
        assert found[5].text.startswith("the tool moved with ")


class TestBaseline:
    def test_same_run_equals_its_baseline(self, result, tmp_path):
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
            (lambda one: one["moves"][1].update(stopped="by hand"), "move 2: stopped is by hand, before nothing"),
            (lambda one: one["moves"][1].update(peak_after_stop_m_s2=None), "peak_after_stop_m_s2 is nothing, before "),
            (lambda one: one["largest_joint_speed"].update(speed_rad_s=3.0), "largest joint speed_rad_s is 3, before "),
            (lambda one: one["warnings"].append({"text": "hot"}), "new warning: hot"),
        ],
    )  # fmt: skip
    def test_each_difference_from_the_baseline_is_reported(self, result, tmp_path, change, said):
        before = read_baseline(kept(tmp_path / "base.json", result), ["a.script"])["a.script"]
        change(now := deepcopy(result))
        (found,) = texts(changes(before, now))
        assert said in found

    def test_missing_warning_and_new_error_are_reported(self, result, tmp_path):
        result["warnings"] = [{"text": "hot"}]
        before = read_baseline(kept(tmp_path / "base.json", result), ["a.script"])["a.script"]
        assert texts(changes(before, {**result, "warnings": []})) == ["no longer warned: hot"]
        uncompiled = {**UNCOMPILED, "file": "a.script"}
        assert texts(changes(before, uncompiled)) == ["exit_reason is compile_error, before finished"]

    def test_baseline_may_have_programs_in_any_order(self, result, tmp_path):
        found = read_baseline(kept(tmp_path / "b.json", UNCOMPILED, result), ["a.script", "wrong.script"])
        assert found["a.script"]["seconds"] == result["seconds"]
        assert found["wrong.script"]["exit_reason"] == "compile_error"

    @pytest.mark.parametrize(
        ("content", "word"),
        [
            ("", "is not what tvist run --lockstep --json prints"),
            ("[1]", "is not what tvist run"),
            ('{"programs": 3}', "is not what tvist run"),
            ('{"file": "a.script", "exit_reason": "compile_error", "lockstep": false}', "in real time"),
            ('{"file": "b.script", "exit_reason": "compile_error"}', "is of b.script, this run is of a"),
            ('{"file": "a.script", "exit_reason": "compile_error", "warnings": "x"}', "is not what tvist run"),
            ('{"programs": []}', "is of nothing"),
            ("[" * 100_000, "is not what tvist run"),
        ],
    )  # fmt: skip
    def test_wrong_baseline_is_refused(self, tmp_path, content, word):
        (tmp_path / "base.json").write_text(content, encoding="utf-8")
        with pytest.raises(BaselineError, match=word) as refused:
            read_baseline(tmp_path / "base.json", ["a.script"])
        assert "base.json" in str(refused.value)


def test_junit_has_a_case_per_program_with_properties(result):
    shook = {"kind": "max_shake", "line": 3, "text": "shook"}
    result["failures"] = [shook, {"kind": "baseline", "line": None, "text": "x"}]
    result |= {"ok": False, "warnings": [{"timestamp": 0.1, "line": 4, "text": "slow\ufffe"}]}
    suites = ET.fromstring(junit([result, UNCOMPILED, {**result, "ok": True, "failures": []}]))  # noqa: S314  our own
    (suite,) = suites
    assert (suites.get("tests"), suite.get("failures")) == ("3", "2")
    bad, wrong, good = suite
    assert [case.get("name") for case in suite] == ["a.script", "wrong.script", "a.script"]
    assert float(bad.get("time")) == pytest.approx(result["seconds"], abs=1e-3)
    measures = {one.get("name"): float(one.get("value")) for one in bad.find("properties")}
    peak = result["largest_peak_after_stop_m_s2"]
    assert measures["largest_peak_after_stop_m_s2"] == pytest.approx(peak, rel=1e-4)
    assert {"seconds", "moves", "largest_joint_speed_rad_s", "largest_tool_speed_m_s"} <= measures.keys()
    failure = bad.find("failure")
    assert (failure.get("type"), failure.get("message")) == ("max_shake", "shook; x")
    assert failure.text == "a.script:3: shook\nx"
    assert wrong.find("failure").text == "wrong.script:2: no x"
    assert good.find("failure") is None
    assert "<b>" in good.find("system-out").text
    assert good.find("system-err").text == "a.script:4: slow\N{REPLACEMENT CHARACTER}"
