"""A robot that is moved through a bridge comes to rest at once, and stays there, whatever goes wrong on the way."""

import contextlib
import random
import signal
import socket
import time
from collections import defaultdict

import pytest
from tests.bridge.link import LinkProcess
from tests.bridge.watch import STILL, Watch, wait_for
from tests.conformance.served import Served
from tests.places import own_address

from tvist_client import MotionStoppedError, RefusedError
from tvist_client.blocking import Robot
from tvist_protocol.modes import RobotMode
from tvist_server.moving.program import State

MOMENTS, SEED = 10, 7
"""Number of faults, which take turns, and the seed of their moments and of what the robot hides."""
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
                    for number in range(MOMENTS):
                        bridge = self.fail(list(EXPECTED)[number % len(EXPECTED)], bridge, link, watch)
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
            wait_for(lambda: not watch.plays and watch.speed < STILL, 20.0 / TIME, f"rest after {fault}")
            rested = watch.count
            if fault in {"kill", "freeze", "cut"}:
                self.figures["braking_ms"].append((fault, 1e3 * watch.since(first).silence))
            time.sleep(self.random.uniform(0.0, 0.3))
            going_on()
            if fault != "kill":
                wait_for(lambda: EXPECTED[fault] in bridge.said[said:], 20.0, f"words on {fault}")
            time.sleep(0.2 / TIME)
            waited = watch.since(rested)
            self.figures["moved_mrad"].append((fault, 1e3 * float(abs(waited.q - waited.q[0]).max())))
            if fault != "kill":
                until_done(arm.unlock_protective_stop if fault == "protective stop" else arm.power_on)
                self.go_on(robot, arm)
        if fault == "kill":
            bridge.kill()
            bridge = self.bridge()
            with Robot.connect(bridge.endpoint, bridge.name) as robot, robot.control("faults") as arm:
                self.go_on(robot, arm)
        self.figures["step_mrad"].append((fault, 1e3 * watch.since(first).largest_step))
        return bridge

    def until_moving(self, bridge, watch, robot, arm):
        """Move until a random moment, unless the robot stops before; return numbers of the row and letter before it."""
        while True:
            until_held(robot, arm)
            first, said = watch.count, len(bridge.said)
            goal = list(self.centre)
            goal[0] += SWING if robot.state().target_q[0] < self.centre[0] else -SWING
            goal[5] += self.random.uniform(-SWING, SWING)
            arm.move_j(goal, velocity=SPEED, wait=False)
            time.sleep(self.random.uniform(0.05, 1.2) / TIME)
            if watch.state is State.FOLLOWING:
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
