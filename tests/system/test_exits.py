"""How `tvist serve` ends, and how it does not begin."""

import json
import resource
import signal
import subprocess
import sys
import threading

import msgpack
import pytest
import zenoh
from tests.conformance.served import PATIENCE, Served, finished, free_endpoint, refused_to_start
from tests.conformance.wire import Wire

from tvist_lab.recordings.mcap_file import read
from tvist_lab.replay import replay_file

FAR = [1.5, -3.0, 0.2, -1.5, 0.1, 0.3]


@pytest.mark.realtime
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGQUIT])
def test_a_signal_in_mid_motion_ends_it_with_the_recording_complete(number, tmp_path):
    path = tmp_path / "run.mcap"
    with Served("--record", str(path), "--truth", cold=True) as served:
        with Wire(served.endpoint) as mover, Wire(served.endpoint) as watcher:
            watcher.listen("state", "truth", "event")
            mover.announce("mover")
            token = mover.command("take_control", client="mover")["token"]
            assert mover.command("set_shaper", token=token, name="zvd")["type"] == "done"
            assert mover.command("move_j", token=token, q=FAR)["type"] == "accepted"
            watcher.wait("state", lambda state: state["target_qd"][0] > 0.2)
            assert served.end(number) == 0
            last = watcher.received["state"][-1]["tick"]
        served.assert_quiet()
        assert f"recorded into {path}" in served.said
    content = read(path)
    assert content.complete
    assert content.note is None
    assert content.recording.missing_ticks == 0
    assert content.states[-1].tick >= last
    assert len(content.truths) == len(content.states)


STOPPED_READER = """
import json, os, signal, sys, zenoh
config = zenoh.Config()
config.insert_json5("mode", '"client"')
config.insert_json5("connect/endpoints", json.dumps([sys.argv[1]]))
session = zenoh.open(config)
session.declare_subscriber("tvist/ur5e/state", lambda sample: None)
next(iter(session.get("tvist/ur5e/info")))
print("ready", flush=True)
os.kill(os.getpid(), signal.SIGSTOP)
"""


@pytest.mark.realtime
@pytest.mark.parametrize("clock", ["realtime", "lockstep"])
def test_a_client_that_has_stopped_reading_does_not_hold_up_the_end(clock, tmp_path):
    """It stands still until the robot has ended, and the recording is complete."""
    path, ticks = tmp_path / "run.mcap", 6000  # more states than its socket holds
    with Served(
        "--clock", clock, *(["--speed", "4"] * (clock == "realtime")), "--record", str(path)
    ) as served:
        reader = subprocess.Popen(
            [sys.executable, "-c", STOPPED_READER, served.endpoint], stdout=subprocess.PIPE
        )
        try:
            assert reader.stdout.readline() == b"ready\n"
            with Wire(served.endpoint) as wire:
                token = wire.command("take_control", client="stepper")["token"]
                assert wire.command("move_j", token=token, q=FAR)["type"] == "accepted"
                wire.listen("state")
                if clock == "lockstep":
                    for _ in range(ticks // 1000):
                        step = msgpack.packb({"type": "simulation.step", "token": token, "ticks": 1000})
                        wire.session.get(wire.key("command"), payload=step, timeout=PATIENCE)
                    wire.until(500)
                else:
                    wire.until(ticks)
                assert served.end() == 0
        finally:
            reader.kill()
            reader.wait(PATIENCE)
            reader.stdout.close()
    assert read(path).complete


ENDS = 50


@pytest.mark.realtime
@pytest.mark.nightly
@pytest.mark.timeout(1800)
def test_fifty_starts_and_ends_with_clients_attached():
    """No hang, no orphan; at moments of a motion that differ."""
    for number in range(ENDS):
        with Served(cold=True) as served:
            with Wire(served.endpoint) as mover, Wire(served.endpoint) as watcher:
                watcher.listen("state", "event")
                token = mover.command("take_control", client="mover")["token"]
                mover.command("move_j", token=token, q=FAR)
                watcher.until(watcher.state()["tick"] + 4 * number)
                code = served.end(signal.SIGINT if number % 2 else signal.SIGTERM)
            assert code == 0, served.said
            served.assert_quiet()
            assert not [line for line in _processes() if served.endpoint in line]


def _processes():
    """Command lines of all processes there are."""
    return subprocess.run(
        ["ps", "-eo", "args"], capture_output=True, text=True, check=True
    ).stdout.splitlines()


@pytest.mark.realtime
def test_a_killed_server_leaves_a_recording_that_can_be_read_and_replays_equal(tmp_path):
    path = tmp_path / "run.mcap"
    with Served("--record", str(path), cold=True) as served:
        with Wire(served.endpoint) as wire:
            token = wire.command("take_control", client="mover")["token"]
            wire.command("move_j", token=token, q=FAR)
            began = wire.state()["tick"]
            wire.until(began + 500)
        served.process.kill()
        served.wait()
    content = read(path)
    assert not content.complete
    assert "was not closed" in content.note
    assert content.states[-1].tick > began  # a chunk holds some 70 states
    assert replay_file(content).first_difference is None


@pytest.mark.realtime
def test_a_disk_that_is_full_ends_the_recording_and_not_the_robot(tmp_path):
    path = tmp_path / "run.mcap"
    with Served("--record", str(path), cold=True) as served:
        with Wire(served.endpoint) as wire:
            tick = wire.state()["tick"]
            resource.prlimit(served.process.pid, resource.RLIMIT_FSIZE, (50_000, 50_000))
            served.wait_until_said("has stopped and is incomplete")
            later = wire.state()["tick"]
            assert later > tick
            assert wire.info()["name"] == "ur5e"
        assert served.end() == 1
        assert served.lines[-1].startswith("tvist: the recording")
    assert read(path).states


@pytest.mark.realtime
def test_clients_see_the_robot_go_at_once():
    gone = threading.Event()

    def on_alive(sample):
        if sample.kind == zenoh.SampleKind.DELETE:
            gone.set()

    with Served(cold=True) as served, Wire(served.endpoint) as wire:
        wire.session.liveliness().declare_subscriber("tvist/ur5e/alive", on_alive, history=True)
        assert wire.info()["name"] == "ur5e"
        assert not gone.is_set()
        assert served.end() == 0
        assert gone.wait(PATIENCE)


class TestDoesNotBegin:
    @pytest.mark.realtime
    def test_a_port_in_use_is_one_sentence_and_leaves_no_recording_behind(self, tmp_path):
        path = tmp_path / "run.mcap"
        with Served(cold=True) as served:
            code, said = refused_to_start("--record", path, endpoint=served.endpoint)
        assert code == 1
        assert "in use" in said
        assert served.endpoint in said
        assert not path.exists()

    @pytest.mark.parametrize("where", ["nowhere/run.mcap", "."])
    def test_a_recording_that_cannot_be_written_is_one_sentence_and_nothing_listens(self, where, tmp_path):
        code, said = refused_to_start("--record", tmp_path / where)
        assert code == 1
        assert str(tmp_path / where) in said
        assert "cannot be written" in said or "exists" in said

    def test_a_recording_that_exists_is_not_replaced(self, tmp_path):
        path = tmp_path / "run.mcap"
        path.write_bytes(b"precious")
        code, said = refused_to_start("--record", path)
        assert code == 1
        assert "exists" in said
        assert path.read_bytes() == b"precious"

    @pytest.mark.parametrize(
        ("key", "value"),
        {
            "name": "Robot One",
            "robot": "nope",
            "payload": "-1",
            "shaper": "zvx",
            "calibration": "nope",
            "clock": "sometimes",
            "speed": "0",
            "start": "Q9",
            "seed": "-1",
        }.items(),
    )
    def test_a_wrong_value_is_misuse_and_the_sentence_names_the_key(self, key, value):
        code, said = refused_to_start(f"--{key}", value)
        assert code == 2
        assert key in said

    @pytest.mark.parametrize("value", ["nan", "inf", "fast"])
    def test_a_number_that_is_none_is_misuse(self, value):
        code, said = refused_to_start("--speed", value)
        assert code == 2
        assert "speed" in said

    @pytest.mark.parametrize("start", ["0,0,0", "0,0,0,0,0,nan", "0,0,0,0,0,9", "0,0,0,0,0,here"])
    def test_a_start_that_is_no_posture_is_misuse(self, start):
        code, said = refused_to_start("--start", start)
        assert code == 2
        assert "start" in said

    def test_an_endpoint_without_a_protocol_is_misuse(self):
        code, said = refused_to_start("--insecure", endpoint="nonsense")
        assert code == 2
        assert "nonsense" in said

    @pytest.mark.parametrize("endpoint", ["tcp/127.0.0.1:99999", "tcp/192.0.2.1:7447"])
    def test_an_endpoint_that_cannot_be_listened_on_is_named(self, endpoint):
        code, said = refused_to_start("--insecure", endpoint=endpoint)
        assert code == 1  # which endpoints there are is Zenoh's to say
        assert endpoint in said

    def test_an_unknown_option_is_misuse(self):
        code, said = refused_to_start("--colour", "red")
        assert code == 2
        assert "--colour" in said


class TestConfigurationFile:
    @pytest.mark.parametrize(
        ("content", "named"),
        [
            ("colour = 'red'", "colour"),
            ("speed = -1.0", "speed"),
            ("speed = nan", "speed"),
            ("truth = 'yes'", "truth"),
            ("start = [0.0, 0.0]", "start"),
            ("shaper = 'zvx'", "zvx"),
            ("speed = ", "robot.toml"),
        ],
    )
    def test_a_fault_is_one_sentence_that_names_the_key(self, content, named, tmp_path):
        path = tmp_path / "robot.toml"
        path.write_text(content, encoding="utf-8")
        code, said = refused_to_start("--config", path)
        assert code == 2
        assert named in said

    def test_one_that_is_not_there_is_misuse(self, tmp_path):
        code, said = refused_to_start("--config", tmp_path / "nope.toml")
        assert code == 2
        assert "nope.toml" in said

    @pytest.mark.realtime
    def test_the_command_line_goes_before_it(self, tmp_path):
        path = tmp_path / "robot.toml"
        path.write_text('name = "from_file"\nclock = "lockstep"\nshaper = "none"\n', encoding="utf-8")
        options = ("--config", str(path), "--shaper", "mzv")
        with Served(*options, name="ours") as served, Wire(served.endpoint, "ours") as wire:
            info = wire.info()
        assert (info["name"], info["clock"], info["shaper"]) == ("ours", "lockstep", "mzv")


class TestCalibrationFile:
    def changed(self, tmp_path, change):
        """The shipped calibration with a change, as a file."""
        from importlib import resources

        content = json.loads(
            (resources.files("tvist_controller.sources") / "ur5e_5kg.json").read_text("utf-8")
        )
        change(content)
        path = tmp_path / "mine.json"
        path.write_text(json.dumps(content), encoding="utf-8")
        return path

    def test_a_sound_one_is_used(self, tmp_path):
        path = self.changed(tmp_path, lambda content: content.update(name="mine"))
        with (
            Served("--calibration", str(path), "--clock", "lockstep") as served,
            Wire(served.endpoint) as wire,
        ):
            assert wire.info()["calibration"]["name"] == "mine"

    @pytest.mark.parametrize(
        ("change", "named"),
        [
            (lambda c: c.update(colour="red"), "colour"),
            (lambda c: c["polynomial"].update(colour="red"), "colour"),
            (lambda c: c.pop("payload"), "payload"),
            (lambda c: c["polynomial"].pop("degree"), "degree"),
            (lambda c: c["payload"].update(mass=-1.0), "mass"),
            (lambda c: c["polynomial"].update(f_d_range=[0.0, 10.0]), "f_d_range"),
            (lambda c: c["polynomial"].update(f_d_range=[10.0, 5.0]), "f_d_range"),
            (lambda c: c["polynomial"].update(f_d_coefficients=[1.0]), "f_d_coefficients"),
            (lambda c: c["polynomial"].update(joints=[9]), "joints"),
            (lambda c: c.update(robot="UR3"), "UR3"),
        ],
    )
    def test_a_fault_is_one_sentence_that_names_the_key(self, change, named, tmp_path):
        code, said = refused_to_start("--calibration", self.changed(tmp_path, change))
        assert code == 2
        assert named in said

    def test_one_that_is_no_json_is_one_sentence(self, tmp_path):
        path = tmp_path / "mine.json"
        path.write_text("{", encoding="utf-8")
        code, said = refused_to_start("--calibration", path)
        assert code == 2
        assert "mine.json" in said


@pytest.mark.realtime
def test_a_controller_that_fails_ends_the_server_with_exit_code_1_and_a_readable_recording(tmp_path):
    """A server that answers but ticks no more would be worse than none."""
    path = tmp_path / "run.mcap"
    program = """
import sys
from tvist_cli.main import main
from tvist_controller.controller import Controller
tick = Controller.complete_tick
def failing(self):
    if self.tick_number == 100:
        raise ArithmeticError("on purpose")
    return tick(self)
Controller.complete_tick = failing
sys.argv = ["tvist", "serve", *sys.argv[1:]]
main()
"""
    ended = finished("-c", program, "--listen", free_endpoint(), "--record", str(path), run=subprocess.run)
    assert ended.returncode == 1
    assert "ArithmeticError: on purpose" in ended.stderr
    assert ended.stderr.splitlines()[-1].startswith("tvist: ")
    content = read(path)
    assert content.complete
    assert content.states[-1].tick == 100
