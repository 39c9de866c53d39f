"""The `tvist` program: one JSON object with `--json`, words for people without, one sentence when it goes wrong.

That each command does what its example says is docs/test_tutorials.py.
"""

import json
import re
import signal
from pathlib import Path

import pytest
from tests.conformance.served import PATIENCE, Served, free_endpoint
from tests.conformance.wire import Wire
from tests.system.shell import begun, tvist

from tvist_cli.output import out, table

HERE = Path(__file__).parent
EXAMPLES = HERE.parents[1] / "clients" / "examples"


def test_check_names_missing_and_present_robots(lockstep, called, monkeypatch):
    monkeypatch.setattr("tvist_client.transports.zenoh.FIND_S", 0.1)
    endpoint = free_endpoint()
    assert called("check", endpoint, "--json").assert_failed(1, endpoint).json["ok"] is False
    called("check", lockstep.endpoint, "--name", "other").assert_failed(1, "'other'", "ur5e")
    assert called("check", lockstep.endpoint, "--json").assert_done().json["state_rate_hz"] is None


def test_commands_report_why_a_robot_has_stopped_and_the_remedy(called):
    with Served("--payload", "20", "--overload", "--clock", "lockstep") as served:
        with Wire(served.endpoint) as wire, wire.control() as token:
            wire.step(token, 10)
        served.wait_until_said("ur5e: protective stop at tick 6: torque of joint")
        served.wait_until_said(f"tvist unlock {served.endpoint}")
        stop = ("not ready", "PROTECTIVE_STOP since tick", "torque of joint", "tvist unlock")
        said = called("check", served.endpoint, "--json").assert_failed(1, *stop).json
        assert (said["ok"], said["ready"], said["stop"]["code"]) == (False, False, "limit_torque")
        called("move", "Q2", "--endpoint", served.endpoint).assert_failed(1, "not ready", "tvist unlock")
        ended = called("unlock", served.endpoint).assert_failed(1, "not ready", "torque of joint")
        assert ended.out.splitlines() == ["unlocked the protective stop", "the robot stopped again at once"]
        assert int(re.search(r"since tick (\d+)", ended.err).group(1)) > 6


def test_a_name_is_required_if_there_are_several_robots(called):
    with Served("--robots", "ur5e*2", "--clock", "lockstep", name=None) as served:
        called("unlock", served.endpoint).assert_failed(1, "ur5e-1, ur5e-2", "--name")
        assert "ur5e-2" in called("unlock", served.endpoint, "--name", "ur5e-2").assert_done().out


@pytest.mark.realtime
def test_watch_prints_an_object_per_line_until_control_c(realtime):
    process = begun("watch", realtime.endpoint, "--json")
    assert json.loads(process.stdout.readline())["type"] == "state"
    process.send_signal(signal.SIGINT)
    _, err = process.communicate(timeout=PATIENCE)
    assert err.startswith("tvist: interrupted: ")
    assert err.endswith(" s; the robot keeps running\n")
    assert process.returncode == 130


@pytest.mark.parametrize(("what", "kept"), json.loads((HERE / "kept_keys.json").read_text("utf-8")).items())
def test_json_output_keeps_its_documented_keys(called, what, kept):
    """Those of a published version: docs/reference/what-stays.md."""
    words = what.split()
    command, list_of_it = words[: 1 + (words[0] == "log")], words[1 + (words[0] == "log") :]
    list_of_it = [key for key in list_of_it if key not in "AB"]
    journal = HERE.parent / "journals" / "live_moves.mcap"
    about = {
        "shapers": (),
        "log analyze A B": (journal, journal),
        "run": (EXAMPLES / "wave.script", "--lockstep"),
    }
    said = called(*command, *about.get(what, (journal,)), "--json").assert_done().json
    for key in list_of_it:
        said = said[key][0]
    assert set(kept) <= said.keys()


def test_version_is_printed():
    assert tvist("--version").assert_done().out.strip().count(".") == 2


@pytest.mark.realtime
@pytest.mark.nightly
def test_the_demo_replays_equal_and_its_recording_gives_the_same_figures(tmp_path):
    said = tvist("demo", "--output", tmp_path / "demo", "--json", cwd=tmp_path).assert_done().json
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


def test_bench_measures_the_computing_time_of_a_tick(called):
    said = called("bench", "--seconds", 0, "--shaper", "EI", "--json").assert_done().json
    assert (said["seconds"], said["shaper"]) == (0, "ei")
    assert 0.0 < said["plant_us_per_tick"] < said["cycle_us_per_tick"]
    assert said["realtime_factor"] == pytest.approx(2000.0 / said["line_us_per_tick"])


@pytest.mark.nightly
@pytest.mark.timeout(1800)
def test_bench_measures_served_robots_and_their_lateness():
    said = tvist("bench", "--seconds", 3, "--json", timeout=1700).assert_done().json
    assert {"cpu_share", "start_s", "end_s", "rss_mb"} <= said.keys()
    assert said["tick"]["late_p50_us"] <= said["tick"]["late_p99_us"] <= said["tick"]["late_max_us"]
    for what in ("setpoint_to_state_ms", "command_ms"):
        assert 0.0 < said[what]["p50"] <= said[what]["p99"]
    assert said["robots_at_500_hz"] >= 0


def test_a_wide_table_is_split_and_repeats_its_first_column(capsys, monkeypatch):
    monkeypatch.setattr(out, "_width", 30)
    table("title", ("name", *"abc"), [("one", *["0123456789"] * 3)])
    lines = capsys.readouterr().out.splitlines()
    assert max(map(len, lines)) <= 30
    assert [line.split()[0] for line in lines if "0123456789" in line] == ["one", "one"]
    assert sum(line.count("0123456789") for line in lines) == 3
