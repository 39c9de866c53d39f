"""A run of a program: how it ends, what it says, how it moves, and how much the tool shakes after each stop."""

from dataclasses import replace

import numpy as np
import pytest
from tests.controller.robots import NoArm
from tests.own_arm import STANDS, OwnArm

from tvist_controller.sources.own_plants import OwnPlant
from tvist_lab.in_process import free_setup
from tvist_lab.metrics import amplitude, motions, tool_acceleration
from tvist_lab.programs.results import as_dict, largest_peak, summary
from tvist_lab.programs.running import InputError, input_command, run_in_lockstep
from tvist_lab.recordings.mcap_file import read
from tvist_lab.replay import replay_file
from tvist_protocol.errors import RefusedError
from tvist_protocol.io import SetRegisters, SimulationSetInputs
from tvist_server.option_values import StartError

THERE, BACK = "[-1.2, -1.5, -2.0, -0.8, 1.6, 0]", "[-1.6, -1.7, -2.2, -0.8, 1.6, 0]"
MOVES = (f"movej({THERE}, a=3, v=2)", "sleep(0.5)", f"movej({BACK}, a=3, v=2)", f"movej({THERE}, a=3, v=2)")


def script(*lines, kind="def"):
    return "\n".join((f"{kind} prog():", *(f"  {line}" for line in lines), "end", ""))


def run(*lines, inputs=(), timeout=100.0, record=None, kind="def", plant=None, **changes):
    setup = replace(free_setup(profile="ursim", **changes), plant=plant)
    return run_in_lockstep(
        setup,
        script(*lines, kind=kind),
        inputs,
        record=record,
        timeout=timeout,
        attend=lambda _: None,
        on_record_error=pytest.fail,
    )


def said(watch, kind="text"):
    return [one.text for one in watch.said if one.kind == kind]


def test_a_program_that_ends_by_itself_is_finished_after_its_robot_time():
    watch = run("sleep(0.3)", 'textmsg("slept")', "sleep(0.2)")
    assert (watch.name, watch.reason, watch.why) == ("prog", "finished", None)
    assert watch.seconds == pytest.approx(0.5)
    assert [(one.tick, one.text) for one in watch.said] == [(151, "slept")]


def test_a_secondary_program_is_run_too():
    watch = run('textmsg("beside")', kind="sec")
    assert (watch.reason, said(watch)) == ("finished", ["beside"])


def test_halt_is_an_end_of_its_own():
    assert run("halt", 'textmsg("never")').reason == "finished"


def test_an_error_has_its_place():
    watch = run("x = [1, 2]", "sleep(0.1)", "y = x[2]")
    assert (watch.reason, watch.error.line, watch.error.column) == ("runtime_error", 4, 9)
    assert "2" in watch.error.text
    assert watch.seconds == pytest.approx(0.1)
    assert said(watch, "warning") == []


def test_a_program_that_a_protective_stop_pauses_has_failed():
    watch = run("movel(p[3, 0, 0.5, 0, 0, 0])", 'textmsg("never")')
    assert watch.reason == "protective_stop"
    assert "no joint positions reach this pose" in watch.why
    assert said(watch) == []


def test_a_pause_that_nobody_can_resume_is_a_failure():
    watch = run('rtde_set_watchdog("input_int_register_0", 10)', "while True:", "sync()", "end")
    assert watch.reason == "paused"
    (warning,) = said(watch, "warning")
    assert "input_int_register_0" in warning


def test_a_timeout_counts_robot_time():
    watch = run("while True:", "sync()", "end", timeout=0.4)
    assert (watch.reason, watch.seconds) == ("timeout", pytest.approx(0.4))


def test_popups_are_told_and_do_not_hold_up_the_program():
    watch = run('popup("part?", title="Ask", error=True, blocking=True)', 'textmsg("on")')
    assert [(one.kind, one.text, one.title, one.level) for one in watch.said] == [
        ("popup", "part?", "Ask", "error"), ("text", "on", None, None),
    ]  # fmt: skip


def test_inputs_are_there_from_the_first_tick():
    watch = run(
        "textmsg(read_input_integer_register(3))",
        "textmsg(read_input_float_register(0))",
        "textmsg(read_input_boolean_register(70))",
        "textmsg(get_standard_digital_in(2))",
        inputs=(
            "input_int_register_3=-7",
            "input_double_register_0=0.5",
            "input_bit_register_70=true",
            "digital_input_2=on",
        ),
    )
    assert said(watch) == ["-7", "0.5", "True", "True"]


def test_inputs_become_commands():
    assert input_command("input_int_register_3 = 4", "t") == SetRegisters(
        token="t", bank="input_int", values=(4,), first=3
    )
    assert input_command("digital_input_17=0", "t") == SimulationSetInputs(
        token="t", digital_input_mask=1 << 17, digital_inputs=0
    )


@pytest.mark.parametrize(
    ("wrong", "word"),
    [
        ("speed=3", "NAME=VALUE"),
        ("input_int_register_3", "NAME=VALUE"),
        ("input_int_register_3=x", "whole number"),
        ("input_int_register_3=3000000000", "2147483647"),
        ("input_double_register_3=x", "a number"),
        ("input_double_register_3=nan", "NaN"),
        ("input_bit_register_3=2", "0 or 1"),
        ("input_bit_register_200=1", "at most 127"),
        ("digital_input_18=1", "0 to 17"),
    ],
)
def test_a_wrong_input_names_the_input_and_what_is_allowed(wrong, word):
    with pytest.raises(InputError, match=word) as refused:
        run("sleep(0.1)", inputs=(wrong,))
    assert repr(wrong) in str(refused.value)


def test_moves_have_their_durations_and_say_when_something_else_stopped_them():
    watch = run(*MOVES, "speedj([0.2, 0, 0, 0, 0, 0], 2, 0.3)")
    planned = watch.moves[:3]
    assert len(watch.moves) == 4
    assert [move.stopped for move in planned] == [None, None, None]
    assert [move.started for move in planned] == sorted(move.started for move in planned)
    assert all(0.3 < (move.ended - move.started) * 0.002 < 2.0 for move in planned)
    assert watch.moves[3].stopped is not None


def test_the_arm_is_watched_until_it_rests_after_the_program():
    watch = run(f"movej({THERE}, a=3, v=2)")
    assert watch.moves[-1].peak is not None
    assert watch.tick >= watch.moves[-1].ended + 150


def test_a_stop_that_the_next_move_follows_at_once_shakes_as_it_would_at_rest():
    quick, slow = (run(*MOVES[:3], *pause, *MOVES[3:], payload=5.0) for pause in ((), ("sleep(0.5)",)))
    assert quick.moves[1].rested < 50 < slow.moves[1].rested
    assert quick.moves[1].peak == pytest.approx(slow.moves[1].peak, rel=0.005)
    assert quick.moves[2].peak != pytest.approx(slow.moves[2].peak, rel=1e-6)  # it began while the tool shook


def test_so_does_a_stop_before_a_motion_that_begins_with_a_jolt():
    jolt, rest = "speedj([0.2, 0, 0, 0, 0, 0], 2, 0.3)", "sleep(0.5)"
    quick, slow = (run(MOVES[0], *pause, jolt, payload=5.0, shaper="auto") for pause in ((), (rest,)))
    assert quick.moves[0].peak == pytest.approx(slow.moves[0].peak, abs=0.003)


def test_moves_and_warnings_have_the_lines_of_the_program():
    up = "movel(pose_trans(get_target_tcp_pose(), p[0, 0, 0.1, 0, 0, 0]), a=30, v=9)"
    watch = run("sleep(0.1)", up, MOVES[0])
    assert [move.line for move in watch.moves] == [3, 4]
    assert [(said.kind, said.line) for said in watch.said] == [("warning", 3)]
    assert watch.fastest_joint.line in {3, 4}


def test_shaping_lets_the_tool_shake_less():
    unshaped = largest_peak(run(*MOVES, payload=5.0))
    shaped = largest_peak(run(*MOVES, payload=5.0, shaper="auto"))
    assert shaped < 0.5 * unshaped


def test_the_peak_is_that_of_the_recorded_truth(tmp_path):
    path = tmp_path / "run.mcap"
    watch = run(*MOVES, payload=5.0, record=path)
    recording = read(path).recording
    alpha = amplitude(tool_acceleration(recording, truth=True))
    for move in (watch.moves[0], watch.moves[2]):
        rows = slice(recording.index(move.ended + 5), recording.index(move.ended + 151))
        assert move.peak == pytest.approx(np.max(alpha[rows]), rel=1e-6)
    assert [motion.stopped for motion in motions(recording)] == [False] * 3


def test_a_recording_replays_to_the_last_bit(tmp_path):
    path = tmp_path / "run.mcap"
    run(*MOVES, 'popup("on?", blocking=True)', inputs=("digital_input_1=1",), record=path)
    again = replay_file(read(path))
    assert again.first_difference is None
    assert [event.kind for event in again.events] == [event.kind for event in read(path).events]


def test_a_program_that_is_refused_leaves_no_recording(tmp_path):
    with pytest.raises(RefusedError, match="script_error"):
        run("nope()", record=tmp_path / "run.mcap")
    assert list(tmp_path.iterdir()) == []


def test_the_report_tells_everything():
    watch = run('textmsg("a")', 'popup("b", title="c")', *MOVES[:2], "y = 1 / 0")
    told = as_dict(watch)
    assert (told["ok"], told["exit_reason"], told["program"]) == (False, "runtime_error", "prog")
    assert told["error"]["line"] == 6
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


def test_of_an_arm_without_truth_nobody_knows_how_its_tool_shakes():
    watch = run(MOVES[0], plant=OwnPlant("mine.py:NoArm", "", lambda *_: NoArm()), truth=False)
    assert (watch.reason, len(watch.moves), largest_peak(watch)) == ("finished", 1, None)


def test_an_arm_that_gives_the_tick_is_not_moved_faster():
    with pytest.raises(StartError, match="the plant OwnArm gives the tick"):
        run(MOVES[0], plant=OwnPlant("mine.py:OwnArm", "", OwnArm), truth=False)


def test_the_recording_begins_where_an_arm_stands(tmp_path):
    class Stands(OwnArm):
        wait = None  # it does not give the tick

    path = tmp_path / "run.mcap"
    run("sleep(0.1)", plant=OwnPlant("mine.py:Stands", "", Stands), truth=False, record=path)
    assert read(path).start["q"] == STANDS.tolist()


def test_a_plant_that_cannot_be_made_is_an_error_of_the_configuration():
    with pytest.raises(StartError, match="which is no plant"):
        run(MOVES[0], plant=OwnPlant("mine.py:nothing", "", lambda *_: None), truth=False)


def test_the_summary_is_a_sentence():
    assert summary(run("sleep(0.5)")) == "prog ran for 0.500 s of robot time"
    assert "made 1 move; after a stop the tool shook with at most 0." in summary(run(MOVES[0]))
