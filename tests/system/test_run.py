"""`tvist run` and `tvist run --check`, as the CI of a robot programmer calls them."""

import json
import signal
import subprocess
import sys
from xml.etree import ElementTree as ET

import pytest
from msgspec.structs import replace
from tests.conformance.served import PATIENCE, free_endpoint
from tests.conformance.wire import Wire
from tests.places import own_address
from tests.system.shell import begun
from tests.system.test_wrong_invocations import assert_said
from tests.system.ur_object import Client

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
FOUND = [
    "wrong.script:2:9: compile_error_name_not_found:x:",
    "wrong.script:3:3: warning: path_offset_enable: this controller does not simulate path offsets",
]


@pytest.fixture(autouse=True)
def _scripts(tmp_path):
    for text in (MOVES, WAITS, FAILS, WRONG):
        (tmp_path / f"{text[4 : text.index('(')]}.script").write_text(text, encoding="utf-8")


@pytest.fixture
def waiting(tmp_path):
    """A real-time process whose program waits for a register, and a client of its robot."""
    endpoint = free_endpoint()
    with begun("run", "waits.script", "--listen", endpoint, cwd=tmp_path) as process:
        assert process.stdout.readline() == "ready\n", process.stderr.read()
        with Wire(endpoint) as wire:
            yield process, wire


def test_program_is_read_from_a_pipe(tmp_path):
    command = [sys.executable, "-m", "tvist_cli", "run", "-", "--lockstep"]
    said = subprocess.run(command, capture_output=True, text=True, check=False, cwd=tmp_path, input=FAILS)
    assert (said.returncode, said.stdout) == (1, "")
    assert "<stdin>:4:9: " in said.stderr


class TestInLockstep:
    def test_messages_go_to_stdout_and_the_summary_to_stderr(self, called):
        code, out, err = called("run", "moves.script", "--lockstep")
        first, popup, last = out.splitlines()
        assert code == 0
        assert first.startswith("from [-1.59")
        assert (popup, last) == ("popup: Popup: go on?", "done")
        assert "moves ran for" in err
        assert "made 2 moves" in err

    def test_error_is_reported_with_file_line_and_column_and_exit_code_1(self, called):
        code, out, err = called("run", "fails.script", "--lockstep")
        *_, place, account = err.splitlines()
        assert (code, out) == (1, "")
        assert place.startswith("fails.script:4:9: ")
        assert account == "tvist: fails.script ended with an error after 0.100 s of robot time"

    def test_program_that_does_not_compile_is_not_started(self, called):
        code, out, err = called("run", "wrong.script", "--lockstep", "--record", "x.mcap", "--json")
        assert code == 1
        assert json.loads(out)["exit_reason"] == "compile_error"
        assert err.splitlines() == [*FOUND, "tvist: wrong.script cannot run: it has 1 error"]

    def test_inputs_and_timeout_of_the_command_line_apply(self, called):
        given = ("--input", "input_int_register_24=7", "--input", "digital_input_3=on")
        assert called("run", "waits.script", "--lockstep", *given)[:2] == (0, "ready\ngot 7\n")
        code, out, err = called("run", "waits.script", "--lockstep", "--timeout", "0.5")
        assert (code, out) == (1, "ready\n")
        assert "failed after 0.500 s of robot time: the program was still running" in err

    def test_robot_follows_options_and_configuration(self, called, tmp_path):
        (tmp_path / "robot.toml").write_text("start = 'Q2'\nspeed = 3.0\n", encoding="utf-8")
        program = "textmsg(get_target_joint_positions())\ntextmsg(get_target_payload())\n"
        (tmp_path / "asks.script").write_text(program, encoding="utf-8")
        options = ("--lockstep", "--config", "robot.toml")
        _, out, _ = called("run", "asks.script", *options, "--payload", "2")
        q, mass = map(json.loads, out.splitlines())
        assert (q, mass) == (pytest.approx(load("ur5e").poses["Q2"], abs=1e-6), 2)
        _, out, _ = called("run", "asks.script", *options, "--start", "-0.5,-1,1,0,0,0")
        q, mass = map(json.loads, out.splitlines())
        assert (q, mass) == (pytest.approx([-0.5, -1, 1, 0, 0, 0], abs=1e-6), 0)

    @pytest.mark.parametrize(
        ("arguments", "words"),
        [
            ("nope.script", ["nope.script", "No such file"]),
            ("moves.script --lockstep --ur", ["--lockstep and --ur exclude each other"]),
            ("moves.script --lockstep --listen tcp/127.0.0.1:1", ["--listen"]),
            ("moves.script --lockstep --timeout 0", ["timeout is 0", "more than 0"]),
            ("moves.script --lockstep --input speed=3", ["input is 'speed=3'", "NAME=VALUE"]),
            ("moves.script --lockstep --input input_int_register_3", ["_register_3'", "NAME=VALUE"]),
            ("moves.script --lockstep --input input_int_register_3=3000000000", ["3000000000", "2147483647"]),
            ("moves.script --lockstep --input input_double_register_3=nan", ["register_3=nan'", "NaN"]),
            ("moves.script --lockstep --input input_bit_register_3=2", ["register_3=2'", "0 or 1"]),
            ("moves.script --lockstep --input input_bit_register_200=1", ["register_200=1'", "at most 127"]),
            ("moves.script --lockstep --input digital_input_18=1", ["'digital_input_18=1'", "0 to 17"]),
            ("moves.script --check --answer x", ["answer is 'x'", "NAME=VALUE"]),
            ("moves.script --check --answer x=1 --answer x=2", ["answer is 'x=2'", "once"]),
            ("moves.script --check --answer x=1", ["no question needs --answer x"]),
            ("moves.script --lockstep --config several.toml", ["robots", "one robot"]),
            ("moves.script --lockstep --config clock.toml", ["clock", "--lockstep"]),
            ("--check --lockstep moves.script", ["--check runs nothing"]),
            ("moves.script wrong.script", ["--lockstep", "--check", "wrong.script"]),
            ("moves.script moves.script --lockstep", ["moves.script is given twice"]),
            ("moves.script waits.script --lockstep --record x", ["record is x", "there are 2"]),
            ("moves.script --max-shake 0", ["max-shake is 0 m/s²", "more than 0"]),
            ("moves.script --max-joint-speed nan", ["max-joint-speed is nan rad/s", "finite"]),
            ("moves.script --junit no/x.xml", ["junit is no/x.xml", "no folder no"]),
            ("moves.script --lockstep --baseline x --junit x", ["the same file"]),
            ("moves.script --baseline x.json", ["--baseline needs --lockstep"]),
            ("moves.script --lockstep --baseline x.json", ["x.json", "No such file"]),
            ("moves.script --lockstep --baseline clock.toml", ["baseline clock.toml is not"]),
            ("--check", ["missing"]),
        ],
    )
    def test_invalid_options_are_refused_with_exit_code_2(self, called, tmp_path, arguments, words):
        (tmp_path / "several.toml").write_text("robots = 'ur5e*2'\n", encoding="utf-8")
        (tmp_path / "clock.toml").write_text("clock = 'lockstep'\n", encoding="utf-8")
        assert_said(called("run", *arguments.split()), 2, words)

    def test_control_c_ends_a_run_with_exit_code_130_and_a_complete_recording(self, tmp_path):
        process = begun("run", "waits.script", "--lockstep", "--record", "x.mcap", cwd=tmp_path)
        assert process.stdout.readline() == "ready\n"
        process.send_signal(signal.SIGINT)
        _, err = process.communicate(timeout=PATIENCE)
        assert process.returncode == 130
        assert "interrupted: waits.script had run for" in err
        assert read(tmp_path / "x.mcap").complete


class TestJudged:
    def test_each_program_has_a_result_and_a_failed_one_makes_exit_code_1(self, called, tmp_path):
        files = ("moves.script", "wrong.script", "fails.script")
        code, out, err = called("run", *files, "--lockstep", "--json", "--junit", "out.xml")
        told = json.loads(out)
        assert (code, told["ok"], told["failed"]) == (1, False, 2)
        assert [one["file"] for one in told["programs"]] == list(files)
        reasons = [one["exit_reason"] for one in told["programs"]]
        assert reasons == ["finished", "compile_error", "runtime_error"]
        assert told["seconds"] == pytest.approx(sum(one.get("seconds", 0.0) for one in told["programs"]))
        assert "moves.script: moves ran for" in err
        assert err.endswith("tvist: 2 of 3 programs failed: wrong.script, fails.script\n")
        (suite,) = ET.parse(tmp_path / "out.xml").getroot()  # noqa: S314  our own
        assert [case.find("failure") is None for case in suite] == [True, False, False]

    def test_each_program_runs_on_a_new_robot(self, called, tmp_path):
        (tmp_path / "again.script").write_text(MOVES, encoding="utf-8")
        code, out, err = called("run", "moves.script", "again.script", "--lockstep", "--json")
        assert err.count(" ran for ") == 2
        one, other = json.loads(out)["programs"]
        assert (code, one.pop("file"), other.pop("file")) == (0, "moves.script", "again.script")
        assert one == other

    def test_exceeded_limit_is_reported_with_its_line_and_exit_code_1(self, called):
        limits = ("--max-shake", "0.01", "--max-seconds", "1")
        code, out, err = called("run", "moves.script", "--lockstep", "--json", *limits)
        told = json.loads(out)
        assert (code, told["ok"], told["exit_reason"]) == (1, False, "finished")
        assert (told["file"], told["lockstep"]) == ("moves.script", True)
        assert told["seconds"] > 1.0
        assert {one["kind"] for one in told["failures"]} == {"max_seconds", "max_shake"}
        first, second, *_ = (line for line in err.splitlines() if line.startswith("moves.script:"))
        assert first.startswith("moves.script: it ran for ")
        assert second.startswith("moves.script:3: after move 1, which stopped at ")
        assert err.endswith("\ntvist: moves.script broke 3 limits\n")

    def test_run_equals_its_baseline_but_not_with_another_shaper(self, called, tmp_path):
        run = ("run", "moves.script", "fails.script", "--lockstep")
        for command in (("run", "moves.script", "--lockstep"), run):
            (tmp_path / "base.json").write_text(called(*command, "--json")[1], encoding="utf-8")
            _, _, err = called(*command, "--baseline", "base.json")
            assert "baseline" not in err
        code, _, err = called(*run, "--baseline", "base.json", "--shaper", "ei")
        assert code == 1
        assert "moves.script:3: move 1: peak_after_stop_m_s2 is " in err
        assert "points" in err


class TestInRealTime:
    pytestmark = pytest.mark.realtime

    def test_states_in_real_time_equal_those_in_lockstep_to_the_last_bit(self, called, tmp_path):
        options = ("--profile", "real", "--seed", "3", "--input", "input_bit_register_64=1")
        given = ("--listen", free_endpoint(), "--record", "real.mcap")
        process = begun("run", "moves.script", *options, *given, cwd=tmp_path)
        out, err = process.communicate(timeout=PATIENCE)
        assert (process.returncode, "profile real) listens on" in err) == (0, True), err
        steps = called("run", "moves.script", *options, "--lockstep", "--record", "steps.mcap")
        assert steps[:2] == (0, out)
        live, steps = (read(tmp_path / f"{name}.mcap") for name in ("real", "steps"))
        assert len(live.states) >= len(steps.states) > 500
        for one, other in zip(live.states, steps.states, strict=False):
            assert replace(one, missed_ticks=0) == other
        # In real time the server also reports the load of the machine.
        ours = [event for event in live.events if "the control loop is" not in (event.why or "")]
        told, wanted = ([(one.tick, one.kind, one.why) for one in of] for of in (ours, steps.events))
        assert told == wanted

    def test_clients_write_registers_and_receive_the_end_of_the_program(self, waiting):
        process, wire = waiting
        wire.listen("event")
        answer = wire.command("set_registers", bank="input_int", first=24, values=[5])
        assert answer["type"] == "done", answer
        wire.wait("event", lambda event: event["kind"] == "program_stopped")
        out, err = process.communicate(timeout=PATIENCE)
        assert (process.returncode, out) == (0, "got 5\n"), err
        assert "waits ran for" in err

    def test_ur_clients_write_registers_of_a_run(self, tmp_path):
        pytest.importorskip("rtde_io")
        address = own_address(3)
        (tmp_path / "ur.toml").write_text(f"ur_address = '{address}'\n", encoding="utf-8")
        (tmp_path / "waits.script").write_text(WAITS.replace("(24)", "(20)"), encoding="utf-8")
        how = ("--ur", "--config", "ur.toml", "--listen", free_endpoint())
        with begun("run", "waits.script", *how, cwd=tmp_path) as process:
            assert process.stdout.readline() == "ready\n"
            while "listens on" not in process.stderr.readline():
                assert process.poll() is None
            with Client("rtde_io", "RTDEIOInterface", address) as client:
                assert client.setInputIntRegister(20, 9)
                out, err = process.communicate(timeout=PATIENCE)
        assert (process.returncode, out) == (0, "got 9\n"), err

    def test_run_fails_when_a_client_stops_its_program(self, waiting):
        process, wire = waiting
        assert wire.command("program.stop")["type"] == "done"
        _, err = process.communicate(timeout=PATIENCE)
        assert process.returncode == 1
        assert err.splitlines()[-1].endswith("of robot time: the program was stopped")

    def test_run_ended_by_sigterm_fails(self, waiting):
        process, _ = waiting
        process.send_signal(signal.SIGTERM)
        _, err = process.communicate(timeout=PATIENCE)
        assert process.returncode == 1
        assert "SIGTERM ended the run" in err


def test_check_reports_each_error_on_a_line_and_exit_code_1(called, tmp_path):
    code, out, err = called("run", "--check", "moves.script", "wrong.script")
    assert (code, out.splitlines(), err) == (1, FOUND, "tvist: 1 error in 2 programs\n")
    code, out, _ = called("run", "--check", "wrong.script", "--json")
    told = json.loads(out)
    assert (code, told["ok"], told["files"], told["errors"]) == (1, False, 1, 1)
    assert told["findings"][0] == {
        "file": "wrong.script", "line": 2, "column": 9, "level": "error",
        "text": "compile_error_name_not_found:x:",
    }  # fmt: skip
    (tmp_path / "warned.script").write_text("path_offset_enable()\n", encoding="utf-8")
    code, out, err = called("run", "--check", "moves.script", "warned.script")
    assert (code, err) == (0, "")
    assert out.startswith("warned.script:1:1: warning: ")
