"""Reads a UR robot with ur-rtde, in a process of its own, since its threads may outlive it.

python ur_reader.py ADDRESS

Says `reading`, and reads until its standard input ends. Then it prints, as JSON, the value of every getter of
RTDEReceiveInterface at one tick after another.
"""

import json
import os
import sys
import threading

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


def main(address):
    ended = threading.Event()
    threading.Thread(target=lambda: sys.stdin.read() or ended.set(), daemon=True).start()
    robot = RTDEReceiveInterface(address, 500.0)
    names = [name for name in dir(robot) if name.startswith(("get", "is")) and name != "isConnected"]
    getters = {name: getattr(robot, name) for name in names}
    print("reading", flush=True)  # noqa: T201  whoever started it waits for that
    read = []
    while not ended.is_set():
        found = values(robot, getters)
        if found is not None and (not read or found["getTimestamp"] != read[-1]["getTimestamp"]):
            read.append(found)
    json.dump({"connected": robot.isConnected(), "read": read}, sys.stdout)
    sys.stdout.flush()
    os._exit(0)


main(*sys.argv[1:])
