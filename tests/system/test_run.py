"""`tvist run` and `tvist run --check`, as a robot programmer's CI starts them."""

import json
import signal
import subprocess
import sys
from xml.etree import ElementTree as ET

import pytest
from msgspec.structs import replace
from tests.conformance.served import NOISE, PATIENCE, finished, free_endpoint
from tests.conformance.wire import Wire
from tests.places import own_address
from tests.system.test_wrong_invocations import assert_said

from tvist_lab.recordings.mcap_file import read
from tvist_plant.description import load

MOVES = """def moves():
  textmsg("from ", get_actual_joint_positions())
  movej([-1.2, -1.5, -2.0, -0.8, 1.6, 0], a=3, v=2)
  popup("go on?", blocking=True)
  movel(pose_trans(get_target_tcp_pose(), p[0, 0, 0.05, 0, 0, 0]), a=1, v=0.3)
  textmsg("done")
end
"""
WAITS = """def waits():
  textmsg("ready")
  while read_input_integer_register(24) == 0:
    sync()
  end
  textmsg("got ", read_input_integer_register(24))
end
"""
FAILS = "def fails():\n  sleep(0.1)\n  x = [1, 2]\n  y = x[2]\nend\n"
WRONG = "def wrong():\n  movej(x)\n  path_offset_enable()\nend\n"
WRITES = """
import sys
from rtde_io import RTDEIOInterface
robot = RTDEIOInterface(sys.argv[1])  # refuses to begin if it may not set outputs
print(robot.setStandardDigitalOut(3, True), flush=True)
print(robot.setInputIntRegister(20, 9), flush=True)
"""


def command(*arguments):
    return [sys.executable, "-m", "tvist_cli", *map(str, arguments)]


@pytest.fixture
def tvist(tmp_path):
    """Run the program in a folder that has the scripts; its exit code, stdout and stderr."""
    for text in (MOVES, WAITS, FAILS, WRONG):
        (tmp_path / f"{text[4 : text.index('(')]}.script").write_text(text, encoding="utf-8")

    def run(*arguments, stdin=""):
        ended = subprocess.run(
            command(*arguments), capture_output=True, text=True, timeout=PATIENCE, check=False,
            cwd=tmp_path, input=stdin,
        )  # fmt: skip
        assert not [word for word in NOISE if word in ended.stderr], ended.stderr
        return ended.returncode, ended.stdout, ended.stderr

    return run


@pytest.fixture
def waiting(tvist, tmp_path):
    """A program that waits for a register on a robot in real time: its process, and a client of the robot."""
    endpoint = free_endpoint()
    process = subprocess.Popen(
        command("run", "waits.script", "--listen", endpoint),
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, cwd=tmp_path,
    )  # fmt: skip
    try:
        assert process.stdout.readline() == "ready\n", process.stderr.read()
        with Wire(endpoint) as wire:
            yield process, wire
    finally:
        process.kill()
        process.communicate(timeout=PATIENCE)


class TestInLockstep:
    def test_messages_are_on_stdout_and_the_account_is_on_stderr(self, tvist):
        code, out, err = tvist("run", "moves.script", "--lockstep")
        first, popup, last = out.splitlines()
        assert code == 0
        assert first.startswith("from [-1.59")
        assert (popup, last) == ("popup: Popup: go on?", "done")
        assert "moves ran for" in err
        assert "made 2 moves" in err

    def test_an_error_is_a_line_that_editors_understand_and_exit_code_1(self, tvist):
        code, out, err = tvist("run", "fails.script", "--lockstep")
        place, account = err.splitlines()
        assert (code, out) == (1, "")
        assert place.startswith("fails.script:4:9: ")
        assert account == "tvist: fails.script ended with an error after 0.100 s of robot time"

    def test_a_program_that_cannot_be_compiled_is_not_started(self, tvist):
        code, out, err = tvist("run", "wrong.script", "--lockstep", "--record", "x.mcap", "--json")
        assert code == 1
        assert json.loads(out)["exit_reason"] == "compile_error"
        assert err.splitlines() == [
            "wrong.script:2:9: compile_error_name_not_found:x:",
            "wrong.script:3:3: warning: path_offset_enable: this controller does not simulate path offsets",
            "tvist: wrong.script cannot run: it has 1 error",
        ]

    def test_with_json_there_is_one_object_and_the_code_is_the_same(self, tvist):
        for name, ok in (("moves", True), ("fails", False)):
            code, out, _ = tvist("run", f"{name}.script", "--lockstep", "--json")
            (line,) = out.splitlines()
            told = json.loads(line)
            assert (told["ok"], code) == (ok, int(not ok))
            assert told["file"] == f"{name}.script"
            assert told["lockstep"] is True
            assert told["seconds"] > 0.0

    def test_the_program_may_come_from_a_pipe(self, tvist):
        assert tvist("run", "-", "--lockstep", stdin='textmsg("piped")\n')[:2] == (0, "piped\n")
        code, _, err = tvist("run", "-", "--lockstep", stdin=FAILS)
        assert code == 1
        assert err.startswith("<stdin>:4:9: ")

    def test_inputs_and_the_timeout_are_those_of_the_command_line(self, tvist):
        given = ("--input", "input_int_register_24=7", "--input", "digital_input_3=on")
        assert tvist("run", "waits.script", "--lockstep", *given)[:2] == (0, "ready\ngot 7\n")
        code, out, err = tvist("run", "waits.script", "--lockstep", "--timeout", 0.5)
        assert (code, out) == (1, "ready\n")
        assert "failed after 0.500 s of robot time: the program was still running" in err

    def test_the_robot_is_that_of_the_options_and_of_the_configuration(self, tvist, tmp_path):
        (tmp_path / "robot.toml").write_text("start = 'Q2'\nspeed = 3.0\n", encoding="utf-8")
        program = "textmsg(get_target_joint_positions())\ntextmsg(get_target_payload())\n"
        options = ("--lockstep", "--config", "robot.toml")
        _, out, _ = tvist("run", "-", *options, "--payload", 2, stdin=program)
        q, mass = map(json.loads, out.splitlines())
        assert (q, mass) == (pytest.approx(load("ur5e").poses["Q2"], abs=1e-6), 2)
        _, out, _ = tvist("run", "-", *options, "--start", "-0.5,-1,1,0,0,0", stdin=program)
        q, mass = map(json.loads, out.splitlines())
        assert (q, mass) == (pytest.approx([-0.5, -1, 1, 0, 0, 0], abs=1e-6), 0)

    @pytest.mark.parametrize(
        ("arguments", "words"),
        [
            (("run", "nope.script"), ["nope.script", "No such file"]),
            (("run", "."), ["program .", "directory"]),
            (("run", "moves.script", "--lockstep", "--ur"), ["--lockstep and --ur exclude each other"]),
            (("run", "moves.script", "--lockstep", "--listen", "tcp/127.0.0.1:1"), ["--listen"]),
            (("run", "moves.script", "--lockstep", "--timeout", "0"), ["timeout is 0", "more than 0"]),
            (("run", "moves.script", "--lockstep", "--input", "x=1"), ["input is 'x=1'", "NAME=VALUE"]),
            (("run", "moves.script", "--lockstep", "--profile", "urs"), ["profile is 'urs'", "'ursim'"]),
            (("run", "moves.script", "--lockstep", "--payload", "9"), ["9 kg", "--overload"]),
            (("run", "moves.script", "--lockstep", "--config", "several.toml"), ["robots", "one robot"]),
            (("run", "moves.script", "--lockstep", "--config", "clock.toml"), ["clock", "--lockstep"]),
            (("run", "--check", "moves.script", "nope.script"), ["nope.script", "No such file"]),
            (("run", "--check", "--lockstep", "moves.script"), ["--check runs nothing"]),
            (("run", "moves.script", "wrong.script"), ["--lockstep", "--check", "wrong.script"]),
            (("run", "moves.script", "moves.script", "--lockstep"), ["moves.script is given twice"]),
            (("run", "-", " -", "--lockstep"), ["<stdin> is given twice"]),
            (
                ("run", "moves.script", "waits.script", "--lockstep", "--record", "x"),
                ["record is x", "these are 2"],
            ),
            (("run", "moves.script", "--max-shake", "0"), ["max-shake is 0 m/s²", "more than 0"]),
            (("run", "moves.script", "--max-seconds", "-1"), ["max-seconds is -1 s", "more than 0"]),
            (("run", "moves.script", "--max-joint-speed", "nan"), ["max-joint-speed is nan rad/s", "finite"]),
            (("run", "moves.script", "--max-tool-speed", "inf"), ["max-tool-speed is inf m/s", "finite"]),
            (("run", "moves.script", "--junit", "no/x.xml"), ["junit is no/x.xml", "no folder no"]),
            (("run", "moves.script", "--junit", "."), ["junit is .", "folder"]),
            (("run", "moves.script", "--lockstep", "--baseline", "x", "--junit", "x"), ["the same file"]),
            (("run", "moves.script", "--baseline", "x.json"), ["--baseline needs --lockstep"]),
            (("run", "moves.script", "--lockstep", "--baseline", "x.json"), ["x.json", "No such file"]),
            (
                ("run", "moves.script", "--lockstep", "--baseline", "clock.toml"),
                ["baseline clock.toml is not"],
            ),
            (("run", "--check", "--max-shake", "1", "moves.script"), ["--check runs nothing"]),
            (("run", "--check", "--junit", "x.xml", "moves.script"), ["--check runs nothing"]),
            (("run", "--check"), ["missing"]),
        ],
        ids=lambda value: " ".join(value) if isinstance(value, tuple) else "",
    )
    @pytest.mark.usefixtures("tvist")
    def test_misuse_is_a_sentence_and_exit_code_2(self, called, tmp_path, arguments, words):
        (tmp_path / "several.toml").write_text("robots = 'ur5e*2'\n", encoding="utf-8")
        (tmp_path / "clock.toml").write_text("clock = 'lockstep'\n", encoding="utf-8")
        assert_said(called(*arguments), 2, words)

    @pytest.mark.usefixtures("tvist")
    def test_control_c_ends_it_with_exit_code_130(self, tmp_path):
        process = subprocess.Popen(
            command("run", "waits.script", "--lockstep", "--record", "x.mcap"),
            stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, cwd=tmp_path,
        )  # fmt: skip
        assert process.stdout.readline() == "ready\n"
        process.send_signal(signal.SIGINT)
        _, err = process.communicate(timeout=PATIENCE)
        assert process.returncode == 130
        assert "interrupted: waits.script had run for" in err
        assert read(tmp_path / "x.mcap").complete


@pytest.mark.usefixtures("tvist")
class TestJudged:
    def test_several_programs_have_a_result_each_and_one_that_fails_makes_exit_code_1(self, called, tmp_path):
        files = ("moves.script", "wrong.script", "fails.script")
        code, out, err = called("run", *files, "--lockstep", "--json", "--junit", "out.xml")
        told = json.loads(out)
        assert (code, told["ok"], told["failed"]) == (1, False, 2)
        assert [one["file"] for one in told["programs"]] == list(files)
        assert [one["exit_reason"] for one in told["programs"]] == [
            "finished",
            "compile_error",
            "runtime_error",
        ]
        assert told["seconds"] == pytest.approx(sum(one.get("seconds", 0.0) for one in told["programs"]))
        assert "moves.script: moves ran for" in err
        assert err.endswith("tvist: 2 of 3 programs failed: wrong.script, fails.script\n")
        (suite,) = ET.parse(tmp_path / "out.xml").getroot()  # noqa: S314  our own
        assert [case.find("failure") is None for case in suite] == [True, False, False]

    def test_each_has_a_fresh_robot(self, called, tmp_path):
        (tmp_path / "again.script").write_text(MOVES, encoding="utf-8")
        code, out, _ = called("run", "moves.script", "again.script", "--lockstep", "--json")
        one, other = json.loads(out)["programs"]
        assert (code, one.pop("file"), other.pop("file")) == (0, "moves.script", "again.script")
        assert one == other
        code, out, err = called("run", "moves.script", "again.script", "--lockstep")
        assert (code, out.count("from ["), out.count("done\n")) == (0, 2, 2)
        assert err.endswith("2 programs ran as they should\n")

    def test_a_broken_limit_is_a_line_with_its_place_and_exit_code_1(self, called):
        code, out, err = called(
            "run", "moves.script", "--lockstep", "--json", "--max-shake", "0.01", "--max-seconds", "1"
        )
        told = json.loads(out)
        assert (code, told["ok"], told["exit_reason"]) == (1, False, "finished")
        assert {one["kind"] for one in told["failures"]} == {"max_seconds", "max_shake"}
        first, second, *_, last = err.splitlines()
        assert first.startswith("moves.script: it ran for ")
        assert second.startswith("moves.script:3: after move 1, which stopped at ")
        assert last == "tvist: moves.script broke 3 limits"

    def test_limits_that_are_kept_change_nothing(self, called):
        given = [
            word
            for name in ("shake", "seconds", "joint-speed", "tool-speed")
            for word in (f"--max-{name}", "9")
        ]
        code, _, err = called("run", "moves.script", "--lockstep", *given)
        assert (code, err.count("\n"), "made 2 moves" in err) == (0, 1, True)

    def test_a_run_equals_its_baseline_and_another_shaper_does_not(self, called, tmp_path):
        run = ("run", "moves.script", "fails.script", "--lockstep")
        for programs in (run[1:2], run[1:3]):
            command = ("run", *programs, "--lockstep")
            (tmp_path / "base.json").write_text(called(*command, "--json")[1], encoding="utf-8")
            _, _, err = called(*command, "--baseline", "base.json")
            assert "baseline" not in err
        code, _, err = called(
            "run", "moves.script", "fails.script", "--lockstep", "--baseline", "base.json", "--shaper", "ei"
        )
        assert code == 1
        assert "moves.script:3: move 1: peak_after_stop_m_s2 is " in err
        assert "points" in err


class TestInRealTime:
    pytestmark = pytest.mark.realtime

    def test_it_moves_the_arm_as_in_lockstep_to_the_last_bit(self, tvist, tmp_path):
        options = ("--profile", "real", "--seed", 3, "--input", "input_bit_register_64=1")
        listen = ("--listen", free_endpoint())
        code, out, err = tvist("run", "moves.script", *options, *listen, "--record", "real.mcap")
        assert code == 0, err
        assert "profile real) listens on" in err
        assert tvist("run", "moves.script", *options, "--lockstep", "--record", "steps.mcap")[:2] == (0, out)
        live, steps = (read(tmp_path / f"{name}.mcap") for name in ("real", "steps"))
        assert len(live.states) >= len(steps.states) > 500
        for one, other in zip(live.states, steps.states, strict=False):
            assert replace(one, missed_ticks=0) == other
        assert [(event.tick, event.kind, event.why) for event in live.events] == [
            (event.tick, event.kind, event.why) for event in steps.events
        ]

    def test_clients_write_its_registers_and_see_it_end(self, waiting):
        process, wire = waiting
        wire.listen("event")
        answer = wire.command("set_registers", bank="input_int", first=24, values=[5])
        assert answer["type"] == "done", answer
        wire.wait("event", lambda event: event["kind"] == "program_stopped")
        out, err = process.communicate(timeout=PATIENCE)
        assert (process.returncode, out) == (0, "got 5\n"), err
        assert "waits ran for" in err

    @pytest.mark.usefixtures("tvist")
    def test_urs_clients_of_this_machine_have_a_hand_in_it(self, tmp_path):
        pytest.importorskip("rtde_io")
        address = own_address(3)
        (tmp_path / "ur.toml").write_text(f"ur_address = '{address}'\n", encoding="utf-8")
        program = tmp_path / "waits.script"
        program.write_text(WAITS.replace("(24)", "(20)"), encoding="utf-8")
        process = subprocess.Popen(
            command("run", program, "--ur", "--config", "ur.toml", "--listen", free_endpoint()),
            stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, cwd=tmp_path,
        )  # fmt: skip
        try:
            assert process.stdout.readline() == "ready\n"
            while "listens on" not in process.stderr.readline():
                assert process.poll() is None
            # In a process of its own, which ur-rtde aborts when the robot has gone.
            client = finished("-c", WRITES, address)
            assert client.stdout == "True\nTrue\n", client.stderr
            out, err = process.communicate(timeout=PATIENCE)
        finally:
            process.kill()
            process.communicate(timeout=PATIENCE)
        assert (process.returncode, out) == (0, "got 9\n"), err

    def test_a_client_that_stops_it_makes_it_fail(self, waiting):
        process, wire = waiting
        assert wire.command("program.stop")["type"] == "done"
        _, err = process.communicate(timeout=PATIENCE)
        assert process.returncode == 1
        assert err.splitlines()[-1].endswith("of robot time: the program was stopped")

    def test_control_c_ends_it_with_exit_code_130(self, waiting):
        process, _ = waiting
        process.send_signal(signal.SIGINT)
        _, err = process.communicate(timeout=PATIENCE)
        assert process.returncode == 130
        assert "interrupted: waits.script had run for" in err

    def test_another_signal_is_no_success(self, waiting):
        process, _ = waiting
        process.send_signal(signal.SIGTERM)
        _, err = process.communicate(timeout=PATIENCE)
        assert process.returncode == 1
        assert "SIGTERM ended the run" in err


class TestCheckScript:
    def test_every_error_is_a_line_on_stdout_and_exit_code_1(self, tvist):
        code, out, err = tvist("run", "--check", "moves.script", "wrong.script")
        assert code == 1
        assert out.splitlines() == [
            "wrong.script:2:9: compile_error_name_not_found:x:",
            "wrong.script:3:3: warning: path_offset_enable: this controller does not simulate path offsets",
        ]
        assert err == "tvist: 1 error in 2 programs\n"

    def test_warnings_alone_are_exit_code_0(self, tvist):
        code, out, err = tvist("run", "--check", "-", stdin="path_offset_enable()\n")
        assert (code, err) == (0, "")
        assert out.startswith("<stdin>:1:1: warning: ")
        assert tvist("run", "--check", "moves.script", "fails.script") == (0, "", "")

    def test_with_json_there_is_one_object(self, tvist):
        code, out, _ = tvist("run", "--check", "wrong.script", "--json")
        assert code == 1
        told = json.loads(out)
        assert (told["ok"], told["files"], told["errors"]) == (False, 1, 1)
        assert told["findings"][0] == {
            "file": "wrong.script", "line": 2, "column": 9, "level": "error",
            "text": "compile_error_name_not_found:x:",
        }  # fmt: skip
