"""The `tvist` program: one JSON object with `--json`, words for people without, one sentence when it goes wrong."""

import json
import math
import re
import signal
import subprocess
import sys
from importlib import resources
from pathlib import Path

import pytest
from tests import forked
from tests.conformance.served import NOISE, PATIENCE, Served, finished, free_endpoint
from tests.conformance.wire import STOPPED, Wire
from tests.lab.two_device_logs import TwoDevices

from tvist_cli.output import out, table
from tvist_client.blocking import Robot
from tvist_plant.description import fingerprint, load

HERE = Path(__file__).parent
NEAR = "0.1,-3.1,0.1,-1.5,0.1,0.1"
BENT = "0,-1.57,1.57,-1.57,-1.57,0"


class Ended:
    """A program that has ended: its exit code, and what it said."""

    def __init__(self, code, out, err):
        self.code, self.out, self.err = code, out, err

    @property
    def json(self):
        """The one JSON object on stdout."""
        (line,) = self.out.splitlines()
        value = json.loads(line)
        assert isinstance(value, dict)
        return value

    def assert_failed(self, code, *words):
        """With this exit code and one sentence on stderr in which these words stand."""
        assert self.code == code, self.err
        assert self.err.startswith("tvist: ")
        assert self.err.count("\n") == 1, self.err
        assert all(word in self.err for word in words), self.err
        return self

    def assert_done(self):
        assert self.code == 0, self.err
        assert not [word for word in NOISE if word in self.err], self.err
        return self


def python(*arguments, **options):
    done = finished(*arguments, **options)
    return Ended(done.returncode, done.stdout, done.stderr)


def tvist(*arguments, **options):
    return python("-m", "tvist_cli", *arguments, **options)


def begun(*arguments):
    """The program, which goes on until it is interrupted."""
    words = [sys.executable, "-m", "tvist_cli", *map(str, arguments)]
    return forked.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


@pytest.fixture(scope="module")
def slow():
    """A robot in real time, but ten times slower, so that no busy machine overloads it."""
    with Served("--speed", "0.1") as served:
        yield served


@pytest.fixture(scope="module")
def recorded(lockstep, tmp_path_factory):
    """A recording that `tvist log record` made of a motion, and what it said; in lockstep no state is lost."""
    path = tmp_path_factory.mktemp("recorded") / "seen.mcap"
    process = begun("log", "record", path, "--endpoint", lockstep.endpoint, "--json")
    try:
        assert "recording ur5e into" in process.stderr.readline()
        assert tvist("move", NEAR, "--endpoint", lockstep.endpoint).code == 0
        with Wire(lockstep.endpoint) as wire, wire.control() as token:
            wire.step(token, 400)  # what rings after the motion
        process.send_signal(signal.SIGINT)
        out, err = process.communicate(timeout=PATIENCE)
        return path, Ended(process.returncode, out, err)
    finally:
        process.kill()
        process.communicate(timeout=PATIENCE)


class TestCheck:
    def test_a_robot_in_real_time_is_well(self, slow):
        said = tvist("check", slow.endpoint, "--json").assert_done().json
        assert (said["ok"], said["robot"], said["protocol"]) == (True, "ur5e", 1)
        assert said["state_rate_hz"] > 0.0

    @pytest.mark.parametrize("ticks", [0, 5])
    def test_a_robot_in_lockstep_is_well_and_has_no_rate(self, lockstep, ticks):
        with Wire(lockstep.endpoint) as wire, wire.control() as token:
            if ticks:
                wire.step(token, ticks)
        said = tvist("check", lockstep.endpoint, "--json").assert_done().json
        assert said["ok"] is True
        assert said["state_rate_hz"] is None

    def test_people_get_a_line_for_each_thing_tried(self, slow):
        said = tvist("check", slow.endpoint).assert_done().out
        assert [line.split()[1] for line in said.splitlines()] == [
            "connect", "info", "state", "refusal", "ready", "load",
        ]  # fmt: skip

    def test_nobody_there_is_a_sentence(self):
        endpoint = free_endpoint()
        tvist("check", endpoint).assert_failed(1, endpoint)
        ended = tvist("check", endpoint, "--json").assert_failed(1, endpoint)
        assert ended.json["ok"] is False

    def test_a_wrong_name_is_a_sentence_that_says_which_there_are(self, realtime):
        tvist("check", realtime.endpoint, "--name", "other").assert_failed(1, "'other'", "ur5e")

    def test_a_machine_with_the_client_alone_can_check_too(self, slow):
        ended = python("-m", "tvist_client", "check", slow.endpoint, "--json")
        assert ended.assert_done().json["ok"] is True


@pytest.fixture
def overloaded():
    """A robot in real time that declares and carries more than its drives can hold."""
    with Served("--payload", "20", "--overload") as served:
        served.wait_until_said("protective stop at tick")
        yield served


@pytest.fixture
def stepped():
    """A robot in lockstep of its own."""
    with Served("--clock", "lockstep") as served:
        yield served


class TestARobotThatStands:
    def test_a_payload_above_the_rating_does_not_start_and_says_how_to_insist(self):
        ended = tvist("serve", "--payload", 20, "--listen", free_endpoint())
        ended.assert_failed(2, "20 kg", "rating of 5 kg", "--overload")

    def test_its_console_says_why_and_what_to_do(self, overloaded):
        (line,) = [line for line in overloaded.lines if "protective stop" in line]
        assert line.startswith("ur5e: protective stop at tick 6: torque of joint")
        assert f"tvist unlock {overloaded.endpoint}" in line

    def test_check_is_readiness_and_with_alive_liveness(self, overloaded):
        ended = tvist("check", overloaded.endpoint)
        ended.assert_failed(1, "not ready", "PROTECTIVE_STOP since tick 6", "torque of joint", "tvist unlock")
        said = tvist("check", overloaded.endpoint, "--json").assert_failed(1, "not ready").json
        assert (said["ok"], said["ready"], said["stop"]["code"]) == (False, False, "limit_torque")
        assert said["state_rate_hz"] > 0.0
        tvist("check", "--alive", overloaded.endpoint).assert_done()
        python("-m", "tvist_client", "check", "--alive", overloaded.endpoint).assert_done()
        assert python("-m", "tvist_client", "check", overloaded.endpoint).code == 1

    def test_an_unlock_that_does_not_hold_says_why_again(self, overloaded):
        ended = tvist("unlock", overloaded.endpoint)
        ended.assert_failed(1, "not ready", "torque of joint")
        assert ended.out.splitlines() == ["unlocked the protective stop", "the robot stopped again at once"]
        (tick,) = re.findall(r"since tick (\d+)", ended.err)
        assert int(tick) > 6
        overloaded.wait_until_said(f"protective stop at tick {tick}: ")

    def test_watch_and_move_say_why(self, overloaded):
        said = tvist("watch", overloaded.endpoint, "--seconds", 1).assert_done().out
        assert "safety_mode PROTECTIVE_STOP" in said
        assert "torque of joint" in said
        tvist("move", "Q2", "--endpoint", overloaded.endpoint).assert_failed(1, "not ready", "tvist unlock")

    def test_unlock_makes_it_ready_and_says_what_it_did(self, stepped):
        with Wire(stepped.endpoint) as wire, wire.control() as token:
            wire.command("simulation.inject", token=token, fault="protective_stop")
            wire.step(token, 5)
        tvist("check", stepped.endpoint).assert_failed(1, "injected")
        assert tvist("unlock", stepped.endpoint).assert_done().out.splitlines() == [
            "unlocked the protective stop",
            "ur5e is ready to be moved",
        ]
        tvist("check", stepped.endpoint).assert_done()
        assert tvist("unlock", stepped.endpoint, "--json").assert_done().json["done"] == []

    def test_unlock_says_what_remains_and_offers_the_power(self, stepped):
        with Wire(stepped.endpoint) as wire, wire.control() as token:
            for fault in ("violation", "safeguard_stop"):
                wire.command("simulation.inject", token=token, fault=fault)
            wire.step(token, 5)
        ended = tvist("unlock", stepped.endpoint)
        ended.assert_failed(1, "SAFEGUARD_STOP", "a safeguard asked for a stop", "release it")
        assert "restarted the safety system" in ended.out
        with Wire(stepped.endpoint) as wire, wire.control() as token:
            wire.command("simulation.inject", token=token, fault="normal")
        tvist("unlock", stepped.endpoint).assert_failed(1, "POWER_OFF", "--power-on")
        said = tvist("unlock", stepped.endpoint, "--power-on", "--json").assert_done().json
        assert (said["ok"], said["robot_mode"]) == (True, "RUNNING")

    def test_the_only_robot_is_found_and_of_several_one_has_to_be_named(self):
        with Served("--clock", "lockstep", name="left") as served:
            assert "left is ready" in tvist("unlock", served.endpoint).assert_done().out
        with Served("--robots", "ur5e*2", "--clock", "lockstep", name=None) as served:
            tvist("unlock", served.endpoint).assert_failed(1, "ur5e-1, ur5e-2", "--name")
            assert "ur5e-2" in tvist("unlock", served.endpoint, "--name", "ur5e-2").assert_done().out

    def test_a_softer_arm_with_the_shipped_calibration_is_a_line_at_the_start(self, tmp_path):
        text = (resources.files("tvist_plant") / "robots" / "ur5e.toml").read_text(encoding="utf-8")
        (tmp_path / "soft.toml").write_text(text.replace("27500.0", "9000.0"), encoding="utf-8")
        with Served("--robot", str(tmp_path / "soft.toml"), "--speed", "0.1") as served:
            served.wait_until_said("was measured on a different arm")
            assert "was measured on a different arm" in tvist("check", served.endpoint).assert_done().out


class TestRecordAndAnalyze:
    def test_control_c_ends_the_recording_and_says_what_is_in_it(self, recorded):
        path, ended = recorded
        said = ended.assert_done().json
        assert said["file"] == str(path)
        assert said["states"] > 400
        assert said["lost"] == 0

    def test_it_ends_by_itself_after_the_time_asked_for(self, realtime, tmp_path):
        path = tmp_path / "second.mcap"
        ended = tvist(
            "log", "record", path, "--endpoint", realtime.endpoint, "--seconds", 1, "--json"
        ).assert_done()
        assert ended.json["states"] > 0
        assert path.stat().st_size > 0

    def test_control_c_before_the_time_asked_for_is_exit_code_130_and_keeps_what_there_is(
        self, realtime, tmp_path
    ):
        path = tmp_path / "short.mcap"
        process = begun("log", "record", path, "--endpoint", realtime.endpoint, "--seconds", 600)
        assert "recording" in process.stderr.readline()
        with Wire(realtime.endpoint) as wire:
            wire.until(wire.state()["tick"] + 50)
        process.send_signal(signal.SIGINT)
        _, err = process.communicate(timeout=PATIENCE)
        assert process.returncode == 130
        assert f"s recorded into {path}" in err.splitlines()[-1]
        tvist("log", "analyze", path, "--json").assert_done()

    def test_analyze_measures_the_motion_and_draws_a_figure_of_it(self, recorded, tmp_path):
        given = (recorded[0], "--figures", tmp_path / "drawn", "--json")
        (motion,) = tvist("log", "analyze", *given).assert_done().json["motions"]
        assert motion["residual_vibration_m_s2"] is not None
        assert 0.3 < motion["stop_s"] - motion["start_s"] < 3.0
        assert {path.name for path in (tmp_path / "drawn").iterdir()} == {"motion_1.png", "ring_down_1.png"}

    def test_analyze_prints_a_table_for_people(self, recorded):
        said = tvist("log", "analyze", recorded[0]).assert_done().out
        assert all(words in said for words in ("RV m/s²", "overshoot", "e_os mm"))
        assert not said.startswith("{")

    def test_what_was_recorded_from_outside_cannot_be_replayed_and_says_why(self, recorded):
        tvist("log", "replay", recorded[0]).assert_failed(1, "serve --record")

    def test_a_file_is_not_replaced(self, realtime, recorded):
        tvist("log", "record", recorded[0], "--endpoint", realtime.endpoint).assert_failed(1, "exists")

    @pytest.mark.parametrize("command", ["analyze", "replay"])
    def test_what_is_no_recording_is_a_sentence(self, command, tmp_path):
        tvist("log", command, tmp_path / "nope.mcap").assert_failed(1, "nope.mcap")
        (tmp_path / "text.mcap").write_text("hello", encoding="utf-8")
        ended = tvist("log", command, tmp_path / "text.mcap", "--json").assert_failed(1, "no MCAP file")
        assert ended.out == ""

    def test_a_robot_in_lockstep_that_nobody_steps_is_recorded_once_and_not_for_ever(
        self, lockstep, tmp_path
    ):
        with Wire(lockstep.endpoint) as wire, wire.control() as token:
            wire.step(token, 1)
        path = tmp_path / "still.mcap"
        options = ("--endpoint", lockstep.endpoint, "--seconds", 1.5, "--json")
        assert tvist("log", "record", path, *options).assert_done().json["states"] == 1


class TestMoveAndWatch:
    def test_move_says_how_long_it_took(self, realtime):
        said = (
            tvist("move", "0,-3.0,0,-1.5,0,0", "--endpoint", realtime.endpoint, "--json").assert_done().json
        )
        assert said["seconds"] == pytest.approx((said["done_tick"] - said["started_tick"]) * 0.002)
        assert "moved to" in tvist("move", NEAR, "--endpoint", realtime.endpoint).assert_done().out

    def test_angles_may_begin_with_a_minus_be_in_degrees_and_poses_in_any_case(self, realtime):
        for target in (("-0.1,-3.1,0.1,-1.5,0.1,0.1",), ("-6,-178,6,-86,6,6", "--degrees"), ("q1",)):
            tvist("move", *target, "--endpoint", realtime.endpoint).assert_done()

    def test_the_only_robot_is_found_whatever_its_name(self):
        with Served(name="other") as served:
            ended = tvist("move", NEAR, "--shaper", "ZV", "--endpoint", served.endpoint)
            assert "moved to" in ended.assert_done().out

    def test_control_c_stops_the_motion_and_says_so(self, realtime):
        with Wire(realtime.endpoint) as wire:
            tvist("move", NEAR, "--endpoint", realtime.endpoint).assert_done()
            wire.listen("state")
            far = "3.0,-3.1,0.1,-1.5,0.1,0.1"
            process = begun("move", far, "--endpoint", realtime.endpoint, "--json")
            wire.wait("state", lambda state: state["target_qd"][0] > 0.3)
            process.send_signal(signal.SIGINT)
            out, err = process.communicate(timeout=PATIENCE)
            assert (process.returncode, out) == (130, "")
            assert err == "tvist: interrupted: the motion was stopped; the robot is at rest\n"
            state = wire.state()
            assert state["runtime_state"] == STOPPED
            assert 0.1 < state["target_q"][0] < 2.9

    def test_the_tool_moves_on_a_line_to_a_place_and_by_a_distance(self, realtime):
        at = ("--endpoint", realtime.endpoint)
        tvist("move", BENT, *at).assert_done()
        assert (
            "moved the tool by 0,0,-0.05 in"
            in tvist("move", "--line", "--by", "0,0,-0.05", *at).assert_done().out
        )
        with Robot.connect(realtime.endpoint) as robot:
            start = robot.forward_kinematics()
            tvist("move", "--line", "-0.45,-0.1,0.5", *at).assert_done()
            assert robot.forward_kinematics() == pytest.approx((-0.45, -0.1, 0.5, *start[3:]), abs=1e-9)
            wanted = (-0.45, -0.1, 0.45, 2.2, 2.2, 0.1)
            target = ",".join(map(str, (*wanted[:3], *map(math.degrees, wanted[3:]))))
            said = (
                tvist("move", "--line", target, "--degrees", "--duration", 1.5, "--json", *at)
                .assert_done()
                .json
            )
            assert robot.forward_kinematics() == pytest.approx(wanted, abs=1e-9)
        assert said["seconds"] == pytest.approx(1.5, abs=0.15)  # and the delay of the shaper

    def test_a_line_that_the_arm_cannot_follow_is_the_robots_sentence_with_a_next_step(self, realtime):
        at = ("--endpoint", realtime.endpoint)
        tvist("move", "Q1", *at).assert_done()
        tvist("move", "--line", "0.5,0,0.5", *at).assert_failed(1, "singular", "Next: move the joints", BENT)
        tvist("move", BENT, *at).assert_done()
        tvist("move", "--line", "2,0,0.5", *at).assert_failed(1, "no_solution")
        tvist("move", "--line", "--by", "0,0,-0.6", *at).assert_failed(
            1, "collision", "floor", "% of the way"
        )

    def test_a_name_of_no_pose_is_answered_with_the_robots_poses(self, realtime):
        ended = tvist("move", "there", "--endpoint", realtime.endpoint)
        assert ended.assert_failed(2, "target is 'there'", "Q1, Q2, Q3").out == ""

    def test_a_target_outside_the_limits_is_the_robots_sentence(self, realtime):
        ended = tvist("move", "9,0,0,0,0,0", "--endpoint", realtime.endpoint, "--json")
        assert ended.assert_failed(1, "limit_position", "q[0]").out == ""

    def test_a_robot_that_another_controls_is_a_sentence_with_its_name(self, realtime):
        with Wire(realtime.endpoint) as wire, wire.control("somebody"):
            tvist("move", NEAR, "--endpoint", realtime.endpoint).assert_failed(1, "somebody")

    def test_stop_ends_the_motion_of_another_who_keeps_control(self, realtime):
        at = ("--endpoint", realtime.endpoint)
        with Wire(realtime.endpoint) as wire, wire.control("somebody") as token:
            wire.listen("state")
            move = {"q": [3.0, -3.0, 0.0, -1.5, 0.0, 0.0], "velocity": 0.2}
            motion = wire.command("move_j", token=token, **move)["id"]
            wire.wait("state", lambda state: state["target_qd"][0] > 0.1)
            said = tvist("stop", "ur5e", *at, "--json").assert_done().json
            assert (said["stopped"], said["control"]) == ([f"motion {motion}"], "somebody")
            assert said["runtime_state"] == "STOPPED"
            assert tvist("stop", *at).assert_done().out == "ur5e: nothing was under way\n"

    def test_stop_leaves_the_steps_of_lockstep_to_who_has_them(self, lockstep):
        with Wire(lockstep.endpoint) as wire, wire.control() as token:
            wire.command("move_j", token=token, q=[0.5, -3.0, 0.0, -1.5, 0.0, 0.0])
            wire.step(token, 100)
            assert "next step" in tvist("stop", "--endpoint", lockstep.endpoint).assert_done().out
            state = wire.until(wire.step(token, 500)["tick"])
            assert (state["runtime_state"], state["target_q"][0] < 0.4) == (STOPPED, True)

    def test_watch_prints_an_object_a_line(self, realtime):
        ended = tvist("watch", realtime.endpoint, "--seconds", 1, "--json").assert_done()
        states = [json.loads(line) for line in ended.out.splitlines()]
        assert {state["type"] for state in states} == {"state"}

    def test_watch_ends_well_at_control_c(self, realtime):
        process = begun("watch", realtime.endpoint, "--json")
        assert process.stdout.readline()
        process.send_signal(signal.SIGINT)
        _, err = process.communicate(timeout=PATIENCE)
        assert err.startswith("tvist: interrupted: ")
        assert err.endswith(" s; the robot keeps running\n")
        assert process.returncode == 130


@pytest.mark.parametrize(("what", "kept"), json.loads((HERE / "kept_keys.json").read_text("utf-8")).items())
def test_the_keys_of_json_stay(what, kept):
    """Those of a published version: docs/reference/what-stays.md."""
    words = what.split()
    command, list_of_it = words[: 1 + (words[0] == "log")], words[1 + (words[0] == "log") :]
    list_of_it = [key for key in list_of_it if key not in "AB"]
    journal = HERE.parent / "journals" / "live_moves.mcap"
    wave = HERE.parents[1] / "clients" / "examples" / "wave.script"
    about = {"shapers": (), "log analyze A B": (journal, journal), "run": (wave, "--lockstep")}
    said = tvist(*command, *about.get(what, (journal,)), "--json").assert_done().json
    for key in list_of_it:
        said = said[key][0]
    assert set(kept) <= said.keys()


def test_help_and_version_are_no_errors():
    assert "serve" in tvist("--help").assert_done().out
    assert tvist("--version").assert_done().out.strip().count(".") == 2


@pytest.mark.nightly
def test_identify_reports_how_good_the_calibration_is_and_serve_takes_it(tmp_path):
    path = tmp_path / "mine.json"
    options = ("--configurations", 40, "--repeats", 1, "--output", path, "--json")
    said = tvist("identify", *options).assert_done().json
    assert {"configurations", "ring_downs", "error_f_d_percent", "error_zeta_percent"} <= said.keys()
    assert said["ring_downs"] == said["configurations"]
    assert said["error_f_d_percent"] < 10.0
    content = json.loads(path.read_text(encoding="utf-8"))
    assert content["name"] == "mine"
    assert content["provenance"]["seed"] == 0
    assert content["provenance"]["arm"] == fingerprint(load("ur5e"))


@pytest.mark.nightly
def test_identify_finds_the_same_calibration_over_the_network_as_in_process(lockstep, tmp_path):
    options = ("--configurations", 37, "--repeats", 1, "--at", "Q1", "--json")
    found = []
    for name, endpoint in (("network", (lockstep.endpoint,)), ("process", ())):
        path = tmp_path / f"{name}.json"
        said = tvist("identify", *endpoint, *options, "--output", path).assert_done().json
        assert said["configurations"] == 38
        found.append(json.loads(path.read_text(encoding="utf-8"))["polynomial"])
    assert found[0] == found[1]


def test_too_few_configurations_for_a_fit_is_a_sentence(tmp_path):
    ended = tvist("identify", "--configurations", 2, "--output", tmp_path / "never.json", "--json")
    assert ended.assert_failed(1, "configurations").out == ""
    assert list(tmp_path.iterdir()) == []


@pytest.mark.realtime
def test_the_demonstration_replays_equal_and_its_recording_gives_the_same_figures(tmp_path):
    ended = tvist("demo", "--output", tmp_path / "demo", "--json", cwd=tmp_path).assert_done()
    said = ended.json
    assert said["replay_equal"] is True
    assert said["recording_gives_same_figures"] is True
    assert len(said["table_2"]) == 3
    assert {path.suffix for path in (tmp_path / "demo").iterdir()} >= {".mcap", ".png"}
    assert (tmp_path / "demo" / "vibration-with-and-without-shaping.png").exists()
    assert [path.name for path in tmp_path.iterdir()] == ["demo"]
    before, after = (said["baselines"]["Q1-Q3"][name]["peak_m_s2"] for name in ("unshaped", "shaped"))
    page = ("--output", tmp_path / "demo.html", "--json")
    first = tvist("log", "report", tmp_path / "demo" / "demo.mcap", *page).assert_done().json["verdict"][0]
    assert f"{100.0 * (1.0 - after / before):.0f} %" in first
    assert "less vibration after the stop with zv than without a shaper, at rest" in first
    shown = tmp_path / "beside.html"
    tvist("view", tmp_path / "demo" / "demo.mcap", "--beside", "--html", shown).assert_done()
    boot = json.loads(re.search(r'id="boot">(.*?)</script>', shown.read_text()).group(1))
    assert boot["result"]["less_percent"] == pytest.approx(100.0 * (1.0 - after / before))
    assert boot["result"]["motion"] == "Q1 → Q3"
    assert [track["label"] for track in boot["tracks"]] == ["without", "with zv"]


def test_the_paper_in_one_run_prints_its_tables(tmp_path):
    how = ("demo", "--runs", 1, "--no-baselines", "--json")
    both = tvist(*how).assert_done().json
    one = tvist(*how, "--robot", "ur5e_stiction").assert_done().json
    for said in (both, one):
        keys = {"robot", "seed", "runs", "shaper", "estimator", "table_1", "table_2", "baselines", "origins"}
        assert keys <= said.keys()
        assert (said["seed"], said["runs"], said["shaper"]) == (0, 1, "zv")
    assert (both["robot"], one["robot"], one["others"]) == ("UR5e", "UR5e_stiction", [])
    (second,) = both["others"]
    assert second == {name: value for name, value in one.items() if name != "others"}


def test_the_bench_tells_how_fast_a_robot_is_computed():
    said = tvist("bench", "--seconds", 0, "--shaper", "EI", "--json").assert_done().json
    assert (said["seconds"], said["shaper"]) == (0, "ei")
    assert 0.0 < said["plant_us_per_tick"] < said["cycle_us_per_tick"]
    assert said["realtime_factor"] == pytest.approx(2000.0 / said["line_us_per_tick"])
    assert said["machine"]["cores"] >= 1


@pytest.mark.nightly
@pytest.mark.timeout(1800)
def test_the_bench_tells_how_many_robots_are_served_and_how_late_they_are():
    said = tvist("bench", "--seconds", 3, "--json", timeout=1700).assert_done().json
    assert {"cpu_share", "start_s", "end_s", "rss_mb"} <= said.keys()
    assert said["tick"]["late_p50_us"] <= said["tick"]["late_p99_us"] <= said["tick"]["late_max_us"]
    for what in ("setpoint_to_state_ms", "command_ms"):
        assert 0.0 < said[what]["p50"] <= said[what]["p99"]
    assert said["robots_at_500_hz"] >= 0


def test_the_bare_client_swings_the_arm_and_measures_what_comes_back(realtime):
    example = Path(__file__).parents[2] / "clients" / "examples" / "01_bare_client.py"
    ended = python(example, realtime.endpoint).assert_done()
    assert ended.err == ""
    _, delay, acceleration = (
        float(line.split(what)[1].split()[0])
        for what in ("round trip", "→ target_q", "largest acceleration")
        for line in ended.out.splitlines()
        if what in line
    )
    assert delay > 0.0  # [ms]: ZV delays by a quarter of a period, 37 ms at Q1's 6.7 Hz, and a tick
    assert acceleration > 0.0  # [rad/s²]


def test_a_table_wider_than_the_screen_is_folded_with_its_first_column_in_each_part(capsys, monkeypatch):
    monkeypatch.setattr(out, "_width", 30)
    table("title", ("name", *"abc"), [("one", *["0123456789"] * 3)])
    lines = capsys.readouterr().out.splitlines()
    assert max(map(len, lines)) <= 30
    assert [line.split()[0] for line in lines if "0123456789" in line] == ["one", "one"]
    assert sum(line.count("0123456789") for line in lines) == 3


def test_every_log_command_reads_the_log_of_a_robot_and_that_of_a_sensor_with_its_own_clock(tmp_path):
    devices = TwoDevices(4, 2.5, 0.003)
    log = devices.robot(tmp_path / "robot.csv", "zeit,achse {}", first=1, units=(1e-3, math.pi / 180.0))
    imu = devices.sensor(tmp_path / "imu.csv", header=None)
    of_robot = ("--columns", "time=zeit:ms,q=achse {}:deg")
    of_imu = ("--imu", imu, "--imu-columns", "time=1,accelerometer=2-4,gyroscope=5-7", "--robot", "ur5e")
    given = (*of_robot, *of_imu)
    analysed = tvist("log", "analyze", log, *given, "--json").assert_done().json
    assert len(analysed["motions"]) == devices.motions
    assert any("joined by its gyroscope" in note for note in analysed["notes"])
    assert "actual_tool_gyroscope" in tvist("log", "analyze", log, *given).assert_done().out
    page = tmp_path / "page.html"
    tvist("log", "report", log, *given, "--output", page).assert_done()
    assert "joined by its gyroscope" in page.read_text()
    joined = tmp_path / "joined.csv"
    tvist("log", "export", log, *given, "--to", "csv", "--output", joined).assert_done()
    again = tvist("log", "analyze", joined, "--json").assert_done().json["motions"]
    assert [one["stop_s"] for one in again] == [one["stop_s"] for one in analysed["motions"]]
    twice = tvist("log", "analyze", log, log, *given, "--imu", imu, "--json").assert_done().json
    assert len(twice["motions"]) == devices.motions
    tvist("log", "analyze", log, *of_robot, "--imu", log).assert_failed(1, "its columns with --imu-columns")
