"""A robot that is moved through a bridge comes to rest at once, and stays there, whatever goes wrong on the way."""

import contextlib
import random
import selectors
import signal
import socket
import threading
import time
from collections import defaultdict

import numpy as np
import pytest
from tests.bridge.link import LinkProcess
from tests.conformance.served import Served
from tests.places import own_address

from tvist_client import MotionStoppedError, RefusedError
from tvist_client.blocking import Robot
from tvist_plant.plant import PERIOD
from tvist_protocol.modes import RobotMode, RuntimeState
from tvist_server.moving.program import NUMBER, STATE, ProgramState
from tvist_server.rtde.client import RtdeClient
from tvist_server.rtde.wire import Field, WireType

SEED = 7
"""Of the faults' moments and of what the robot hides."""
TIME = 0.5
"""Speed of the robot's time, for machines on which others compute; all times are by its clock."""
SPEED, SWING = 0.4, 0.3
"""Speed of the moves [rad/s], and how far the base turns either way [rad]."""
EXPECTED = {
    "kill": "",
    "freeze": "no set-point reached it",
    "cut": "the robot at",
    "pause": "its program was paused",
    "protective stop": "has made a protective stop",
}
"""Kinds of faults, and what the bridge has to say of each; a bridge that was killed says nothing."""
LIMITS = {"braking_ms": 40.0, "step_mrad": 2.0, "moved_mrad": 0.1}
"""Largest time from the last set-point's arrival until braking begins, way of a joint's target in a period until the
next motion has ended, and way from its rest until the bridge was told to go on.
"""


OUTPUT, INPUT = f"output_int_register_{STATE}", f"input_int_register_{NUMBER}"
READ = {
    "timestamp": WireType.DOUBLE, "target_q": WireType.VECTOR6D, "target_qd": WireType.VECTOR6D,
    "runtime_state": WireType.UINT32, INPUT: WireType.INT32, OUTPUT: WireType.INT32,
}  # fmt: skip
STILL = 1e-6
"""Speed below which the target is at rest [rad/s]."""


class Watch:
    """Reads a robot's rows from its own RTDE interface, without a link in between, in a thread of its own."""

    def __init__(self, robot):
        self._client = RtdeClient({name: Field(wire) for name, wire in READ.items()}, {})
        self._socket = socket.create_connection((robot, 30004))
        self.rows, self._ended = [], False
        self._thread = threading.Thread(target=self._read, daemon=True)

    def __enter__(self):
        self._socket.sendall(self._client.begin())
        self._thread.start()
        return self

    def __exit__(self, *_):
        self._ended = True
        self._thread.join()
        self._socket.close()

    def _read(self):
        with selectors.DefaultSelector() as ready:
            ready.register(self._socket, selectors.EVENT_READ)
            while not self._ended:
                if ready.select(0.1):
                    received = self._client.receive(self._socket.recv(1 << 16))
                    self.rows += received.rows
                    if received.send:
                        self._socket.sendall(received.send)

    @property
    def follows(self):
        """Whether the program follows set-points."""
        return int(self.rows[-1][OUTPUT][0]) == ProgramState.FOLLOWING

    @property
    def rests(self):
        """Whether the robot plays no program, and its target is at rest."""
        plays = int(self.rows[-1]["runtime_state"][0]) == RuntimeState.PLAYING
        return not plays and max(map(abs, self.rows[-1]["target_qd"])) < STILL

    def since(self, first):
        """Columns of the rows from one on, as many of each."""
        rows = self.rows[first:]
        return {name: np.array([row[name] for row in rows]).squeeze() for name in READ}

    def largest_step(self, first):
        """Largest way of a joint's target in a period [rad]."""
        course = self.since(first)
        ways = np.abs(np.diff(course["target_q"], axis=0)).max(axis=1)
        return float((ways / np.round(np.diff(course["timestamp"]) / PERIOD)).max())

    def silence(self, first):
        """Time from the last new number before braking to the beginning of braking [s].

        Braking has begun at the last row before rest at which the fastest joint was not slower than a row before, or
        where the program reports it, whichever is later.
        """
        course = self.since(first)
        speed, time = np.abs(course["target_qd"]).max(axis=1), course["timestamp"]
        said = int(np.argmax(course[OUTPUT] >= ProgramState.BRAKING))  # 0 if it does not report it
        rest = int(np.argmax(speed[said:] < STILL)) + said
        faster = np.flatnonzero(np.diff(speed[: rest + 1]) >= 0.0)
        begun = max(said, int(faster[-1]) + 1 if len(faster) else 0)
        came = np.flatnonzero(np.diff(course[INPUT][: begun + 1]))
        return float(time[begun] - time[came[-1] + 1 if len(came) else 0])


def wait_for(true, seconds, what):
    """Wait until something is so."""
    deadline = time.monotonic() + seconds
    while not true():
        assert time.monotonic() < deadline, f"{what}: not within {seconds:g} s"
        time.sleep(0.005)


class Faults:
    """Lets things go wrong, and keeps the figures of each fault."""

    def __init__(self):
        self.robot, self.near = own_address(41), own_address(42)
        self.random, self.figures = random.Random(SEED), defaultdict(list)
        self.others = 0
        """Number of stops between the faults, as on a machine that is too busy."""

    def run(self):
        real = "--profile", "real", "--shaper", "none", "--speed", f"{TIME:g}", "--hidden", str(SEED)
        with Served("--ur", "--ur-address", self.robot, *real, name="arm") as served:
            with Robot.connect(served.endpoint, served.name) as there:
                self.centre = list(there.state().target_q)
            with LinkProcess(self.robot, self.near, SEED, 1.0 / TIME) as link, Watch(self.robot) as watch:
                bridge = self.bridge()
                try:
                    for fault in EXPECTED:
                        bridge = self.fail(fault, bridge, link, watch)
                finally:
                    bridge.kill()

    def bridge(self):
        bridge = Served("--plant", f"ur://{self.near}", "--enable-motion", name="bridge")
        bridge.wait_until_ready()
        return bridge

    def fail(self, fault, bridge, link, watch):
        """Let something go wrong during a motion, and make another one afterwards; return the bridge."""
        with Robot.connect(bridge.endpoint, bridge.name) as robot, robot.control("faults") as arm:
            first, said = self.until_moving(bridge, watch, robot, arm)
            going_on = self.break_off(fault, bridge, link)
            wait_for(lambda: watch.rests, 20.0 / TIME, f"rest after {fault}")
            rested = len(watch.rows)
            if fault in {"kill", "freeze", "cut"}:
                self.figures["braking_ms"].append((fault, 1e3 * watch.silence(first)))
            time.sleep(self.random.uniform(0.0, 0.3))
            going_on()
            if fault != "kill":
                wait_for(lambda: EXPECTED[fault] in bridge.said[said:], 20.0, f"words on {fault}")
            time.sleep(0.2 / TIME)
            waited = watch.since(rested)["target_q"]
            self.figures["moved_mrad"].append((fault, 1e3 * float(abs(waited - waited[0]).max())))
            if fault != "kill":
                until_done(arm.unlock_protective_stop if fault == "protective stop" else arm.power_on)
                self.go_on(robot, arm)
        if fault == "kill":
            bridge.kill()
            bridge = self.bridge()
            with Robot.connect(bridge.endpoint, bridge.name) as robot, robot.control("faults") as arm:
                self.go_on(robot, arm)
        self.figures["step_mrad"].append((fault, 1e3 * watch.largest_step(first)))
        return bridge

    def until_moving(self, bridge, watch, robot, arm):
        """Move until a random moment, unless the robot stops before; return numbers of the row and letter before it."""
        while True:
            until_held(robot, arm)
            first, said = len(watch.rows), len(bridge.said)
            goal = list(self.centre)
            goal[0] += SWING if robot.state().target_q[0] < self.centre[0] else -SWING
            goal[5] += self.random.uniform(-SWING, SWING)
            arm.move_j(goal, velocity=SPEED, wait=False)
            time.sleep(self.random.uniform(0.05, 1.2) / TIME)
            if watch.follows:
                return first, said
            self.others += 1

    def go_on(self, robot, arm):
        while True:
            until_held(robot, arm)
            goal = list(robot.state().target_q)
            goal[0] += 0.02 if goal[0] < self.centre[0] else -0.02
            try:
                return arm.move_j(goal, velocity=SPEED)
            except MotionStoppedError:
                self.others += 1

    def break_off(self, fault, bridge, link):
        """Let something go wrong; return what puts it right."""
        match fault:
            case "kill":
                bridge.process.send_signal(signal.SIGKILL)
                return lambda: None
            case "freeze":
                bridge.process.send_signal(signal.SIGSTOP)
                time.sleep(self.random.uniform(0.06, 0.5) / TIME)
                return lambda: bridge.process.send_signal(signal.SIGCONT)
            case "cut":
                how, back = self.random.choice((("cut", "restore"), ("hold", "flow")))
                link.do(how)
                return lambda: link.do(back)
            case "pause":
                self.dashboard("pause")
                return lambda: self.dashboard("play")
            case _:
                with socket.create_connection((self.robot, 30002), 10.0) as connection:
                    connection.sendall(b"sec stopping():\n  protective_stop()\nend\n")
                return self.unlock

    def dashboard(self, line):
        with (
            socket.create_connection((self.robot, 29999), 10.0) as connection,
            connection.makefile("rw") as spoken,
        ):
            spoken.readline()
            print(line, file=spoken, flush=True)
            return spoken.readline().strip()

    def unlock(self):
        """Unlock the stop, which takes until it is five seconds old, and let the program go on, as a person may."""
        unlock = "unlock protective stop"
        wait_for(lambda: self.dashboard(unlock) == "Protective stop releasing", 20.0 / TIME, "unlocking")
        self.dashboard("play")


def until_held(robot, arm):
    """Move by nothing, after a stop for which nobody was the cause once it is over."""

    def hold():
        if robot.state().robot_mode != RobotMode.RUNNING:
            arm.power_on()
        arm.move_j(robot.state().target_q, velocity=SPEED)

    until_done(hold)


def until_done(do):
    """Ask for something again until it is not refused."""

    def done():
        with contextlib.suppress(RefusedError):
            do()
            return True

    wait_for(done, 60.0, "what is not refused")


@pytest.mark.nightly
@pytest.mark.realtime
def test_whatever_fails_between_a_program_and_the_robot_it_brakes_at_once_and_rests(measured):
    faults = Faults()
    faults.run()
    measured("stops between the faults", faults.others)
    for what, limit in LIMITS.items():
        fault, most = max(faults.figures[what], key=lambda one: one[1])
        measured(what, f"{most:.3g} after {fault}")
        assert most <= limit, fault
