"""Reads a UR robot with ur-rtde, in a process of its own, since its threads may outlive it.

python ur_reader.py ADDRESS SECONDS [MOST]

Prints, as JSON, the value of every getter of RTDEReceiveInterface at one tick after another, of so many ticks at most.
"""

import json
import os
import sys
import time

from rtde_receive import RTDEReceiveInterface

SEVERAL = {
    "getDigitalInState": range(18),
    "getDigitalOutState": range(18),
    "getOutputIntRegister": range(12, 20),
    "getOutputDoubleRegister": range(12, 20),
}
"""Getters that are asked for one of several, and which."""


def values(robot, getters):
    """Of one tick: of every getter, or None where a tick came between them."""
    began = robot.getTimestamp()
    found = {
        name: [get(number) for number in SEVERAL[name]] if name in SEVERAL else get()
        for name, get in getters.items()
    }
    return found if robot.getTimestamp() == began else None


def main(address, seconds, most):
    robot = RTDEReceiveInterface(address, 500.0)
    names = [name for name in dir(robot) if name.startswith(("get", "is")) and name != "isConnected"]
    getters = {name: getattr(robot, name) for name in names}
    first, began, read = robot.getTimestamp(), time.monotonic(), []
    while time.monotonic() - began < seconds:
        found = values(robot, getters)
        new = found is not None and (not read or found["getTimestamp"] != read[-1]["getTimestamp"])
        if new and len(read) < most:
            read.append(found)
    ticks, took = round((robot.getTimestamp() - first) / 0.002), time.monotonic() - began
    connected = robot.isConnected()
    json.dump({"connected": connected, "ticks": ticks, "seconds": took, "read": read}, sys.stdout)
    sys.stdout.flush()
    os._exit(0)


main(sys.argv[1], float(sys.argv[2]), int(sys.argv[3]) if len(sys.argv) > 3 else 100_000)
