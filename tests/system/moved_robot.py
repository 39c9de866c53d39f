"""A robot that is moved through a bridge, in two processes, with a link between them that can fail."""

import contextlib
import socket

import numpy as np
from tests.conformance.served import Served
from tests.system.proxy import Proxy

SPEED = "0.2"
"""Speed of the robot's time, so that a busy machine is on time, too."""
DASHBOARD, PRIMARY, SECONDARY, RTDE = 29999, 30001, 30002, 30004


def a_robot(host, *options, seed="1001"):
    """The robot in its own process: it shapes nothing, as UR's do."""
    real = ("--profile", "real", "--shaper", "none", "--hidden", seed, "--speed", SPEED)
    return Served("--ur", "--ur-address", host, *real, *options)


def a_bridge(host, *options):
    return Served("--plant", f"ur://{host}", "--enable-motion", *options, name="bridge")


class Link:
    """Passes on what a bridge and the robot at `host` say to each other, at `near`."""

    def __init__(self, host, near):
        self._ports = [Proxy(f"tcp/{host}:{port}", (near, port)) for port in (DASHBOARD, PRIMARY, RTDE)]

    def __enter__(self):
        return self

    def __exit__(self, *error):
        self.cut()

    def __getattr__(self, name):
        """What is done to it is done to all of its ports."""

        def do():
            for port in self._ports:
                getattr(port, name)()

        return do


def tell(host, *lines, port=DASHBOARD):
    """Say something to the robot's dashboard, or send a program; what it answers."""
    with socket.create_connection((host, port), 10.0) as connection, connection.makefile("rw") as spoken:
        if port == DASHBOARD:
            spoken.readline()
        answers = []
        for line in lines:
            spoken.write(f"{line}\n")
            spoken.flush()
            if port == DASHBOARD:
                answers.append(spoken.readline().strip())
        return answers


def protective_stop(host):
    """Let the robot make a protective stop, beside the program that runs."""
    tell(host, "sec stopping():\n  protective_stop()\nend", port=SECONDARY)


@contextlib.contextmanager
def states_of(robot):
    """All states of a robot while this lasts."""
    states = []
    stop = robot.on_state(states.append)
    try:
        yield states
    finally:
        stop()


def largest_step(states):
    """The largest way of a joint's target in a control period [rad]."""
    ticks = np.array([state.tick for state in states])
    targets = np.array([state.target_q for state in states])
    ways = np.abs(np.diff(targets, axis=0)).max(axis=1) / np.diff(ticks)
    return float(ways.max())
