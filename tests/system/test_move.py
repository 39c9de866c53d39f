"""`tvist move` and `tvist stop`, and the example that streams set-points without a package of tvist."""

import math
import signal
from pathlib import Path

import pytest
from tests.conformance.served import PATIENCE
from tests.conformance.wire import STOPPED, Wire
from tests.system.shell import begun, python

from tvist_client.blocking import Robot

EXAMPLE = Path(__file__).parents[2] / "clients" / "examples" / "01_bare_client.py"
NEAR = "0.1,-3.1,0.1,-1.5,0.1,0.1"
BENT = "0,-1.57,1.57,-1.57,-1.57,0"


def test_move_accepts_radians_degrees_and_pose_names(lockstep, called):
    at = ("--endpoint", lockstep.endpoint)
    said = called("move", "-0.1,-3.0,0,-1.5,0,0", *at, "--json").assert_done().json
    assert said["seconds"] == pytest.approx((said["done_tick"] - said["started_tick"]) * 0.002)
    called("move", "-6,-178,6,-86,6,6", "--degrees", *at).assert_done()
    assert "moved to" in called("move", "q1", "--shaper", "ZV", *at).assert_done().out


def test_move_line_goes_to_a_position_and_by_a_distance(lockstep, called):
    at = ("--endpoint", lockstep.endpoint)
    called("move", BENT, *at).assert_done()
    moved = called("move", "--line", "--by", "0,0,-0.05", *at).assert_done().out
    assert "moved the tool by 0,0,-0.05 in" in moved
    with Robot.connect(lockstep.endpoint) as robot:
        wanted = (-0.45, -0.1, 0.45, 2.2, 2.2, 0.1)
        target = ",".join(map(str, (*wanted[:3], *map(math.degrees, wanted[3:]))))
        line = ("--line", target, "--degrees", "--duration", 1.5, "--json")
        said = called("move", *line, *at).assert_done().json
        assert robot.forward_kinematics() == pytest.approx(wanted, abs=1e-9)
        assert said["seconds"] == pytest.approx(1.5, abs=0.15)  # and the delay of the shaper
        called("move", "--line", "-0.45,-0.1,0.5", *at).assert_done()
        assert robot.forward_kinematics() == pytest.approx((-0.45, -0.1, 0.5, *wanted[3:]), abs=1e-9)


def test_a_refused_move_prints_the_reason_of_the_robot(lockstep, called):
    at = ("--endpoint", lockstep.endpoint)
    called("move", "Q1", *at).assert_done()
    for target, code, words in (
        (("--line", "0.5,0,0.5"), 1, ("singular", "Next: move the joints", BENT)),
        (("--line", "2,0,0.5"), 1, ("no_solution",)),
        (("there",), 2, ("target is 'there'", "Q1, Q2, Q3")),
        (("9,0,0,0,0,0",), 1, ("limit_position", "q[0]")),
    ):
        assert called("move", *target, *at).assert_failed(code, *words).out == ""
    with Wire(lockstep.endpoint) as wire, wire.control("somebody"):
        called("move", NEAR, *at).assert_failed(1, "somebody")


@pytest.mark.realtime
def test_control_c_stops_the_motion(realtime):
    with Wire(realtime.endpoint) as wire:
        wire.listen("state")
        process = begun("move", "3.0,-3.1,0.1,-1.5,0.1,0.1", "--endpoint", realtime.endpoint, "--json")
        wire.wait("state", lambda state: state["target_q"][0] > 0.1)
        process.send_signal(signal.SIGINT)
        out, err = process.communicate(timeout=PATIENCE)
        assert (process.returncode, out) == (130, "")
        assert err == "tvist: interrupted: the motion was stopped; the robot is at rest\n"
        state = wire.state()
        assert state["runtime_state"] == STOPPED
        assert 0.1 < state["target_q"][0] < 2.9


@pytest.mark.realtime
def test_stop_ends_the_motion_of_another_client_which_keeps_control(realtime, called):
    at = ("--endpoint", realtime.endpoint)
    with Wire(realtime.endpoint) as wire, wire.control("somebody") as token:
        wire.listen("state")
        move = {"q": [3.0, -3.0, 0.0, -1.5, 0.0, 0.0], "velocity": 0.2}
        motion = wire.command("move_j", token=token, **move)["id"]
        wire.wait("state", lambda state: state["target_qd"][0] > 0.1)
        said = called("stop", "ur5e", *at, "--json").assert_done().json
        assert (said["stopped"], said["control"]) == ([f"motion {motion}"], "somebody")
        assert said["runtime_state"] == "STOPPED"
        assert called("stop", *at).assert_done().out == "ur5e: nothing was under way\n"


@pytest.mark.realtime
def test_the_bare_client_swings_the_arm_and_measures_its_response(realtime, tmp_path):
    shorter = tmp_path / "bare_client.py"
    text = EXAMPLE.read_text(encoding="utf-8")
    assert "SECONDS = 0.008, 10.0" in text
    shorter.write_text(text.replace("SECONDS = 0.008, 10.0", "SECONDS = 0.008, 1.0"), encoding="utf-8")
    ended = python(shorter, realtime.endpoint).assert_done()
    assert ended.err == ""
    for what in ("→ target_q", "largest acceleration"):
        (line,) = (line for line in ended.out.splitlines() if what in line)
        assert float(line.split(what)[1].split()[0]) > 0.0
