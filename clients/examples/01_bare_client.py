"""Stream a sine to a robot and measure its response, with only eclipse-zenoh and msgpack.

    pip install eclipse-zenoh msgpack
    python 01_bare_client.py [ENDPOINT] [ROBOT]        default: tcp/127.0.0.1:7447 ur5e

Takes control, swings the base joint around its present position with set-points at 125 Hz for 10 s, comes to rest,
gives control back and prints the results. Keys and messages: protocol/README.md.
"""

import json
import math
import queue
import statistics
import sys
import time
from collections.abc import Callable, Sequence
from typing import Any

import msgpack
import zenoh

ENDPOINT, ROBOT = (*sys.argv[1:3], *("tcp/127.0.0.1:7447", "ur5e")[len(sys.argv) - 1 :])
PERIOD, SECONDS = 0.008, 10.0  # [s]
AMPLITUDE, FREQUENCY = 0.2, 0.5  # [rad], [Hz]
TICK = 0.002  # the robot's control period [s]


def ask(session: zenoh.Session, leaf: str, **message: object) -> dict[str, Any]:
    """Query a key, with a message if there is one; return the answer, or end the program if refused."""
    payload = msgpack.packb(message) if message else None
    for reply in session.get(f"tvist/{ROBOT}/{leaf}", payload=payload, timeout=10.0):
        if reply.ok:
            answer: dict[str, Any] = msgpack.unpackb(reply.ok.payload.to_bytes())
            if answer["type"] == "refused":
                sys.exit(f"refused, {answer['code']}: {answer['why']}")
            return answer
    # A query that reaches no robot ends at once without a reply.
    return sys.exit(f"no robot {ROBOT} answers at {ENDPOINT}: does the server run?")


def swing(t: float) -> float:
    """Return the offset of the base joint at time t [rad]: a sine, faded in and out over one second each."""
    fade = math.sin(math.pi / 2 * min(1.0, t, SECONDS - t)) ** 2
    return AMPLITUDE * fade * math.sin(2 * math.pi * FREQUENCY * t)


def delay(reference: Sequence[float], target: Sequence[float], longest: int = 100) -> float:
    """Return by how many samples `target` lags behind `reference`: least squares, interpolated by a parabola."""
    n = range(longest, len(target))
    error = [sum((target[i] - reference[i - lag]) ** 2 for i in n) for lag in range(longest + 1)]
    best = min(range(1, longest), key=error.__getitem__)
    before, least, after = error[best - 1 : best + 2]
    return best + (before - after) / (2 * (before - 2 * least + after))


def median_ms(function: Callable[[], object]) -> float:
    """Median duration of a hundred calls [ms]."""
    durations = []
    for _ in range(100):
        began = time.perf_counter()
        function()
        durations.append(time.perf_counter() - began)
    return 1e3 * statistics.median(durations)


def main() -> None:
    """Take control, swing, give control back, print the results."""
    config = zenoh.Config()
    config.insert_json5("mode", '"client"')
    config.insert_json5("connect/endpoints", json.dumps([ENDPOINT]))
    config.insert_json5("scouting/multicast/enabled", "false")
    try:
        session = zenoh.open(config)
    except zenoh.ZError:
        sys.exit(f"nobody listens at {ENDPOINT}: does the server run?")
    with session:  # an open session could keep the process from ending
        info = ask(session, "info")
        if info["clock"] != "realtime":
            sys.exit(f"this example needs a robot in real time; {ROBOT} is in {info['clock']}")

        # Zenoh itself answers the first query at once; the robot answers the second at the start of its next tick.
        trip = median_ms(lambda: list(session.liveliness().get(f"tvist/{ROBOT}/alive")))
        answer = median_ms(lambda: ask(session, "info"))

        # Zenoh calls back in its own thread, so the callback only fills a queue.
        inbox: queue.SimpleQueue[bytes] = queue.SimpleQueue()
        session.declare_subscriber(
            f"tvist/{ROBOT}/state", lambda sample: inbox.put(sample.payload.to_bytes())
        )

        def next_state() -> dict[str, Any]:
            state: dict[str, Any] = msgpack.unpackb(inbox.get(timeout=5.0))
            return state

        # If this program dies, this token disappears, and the robot ends its control at once. The session's
        # id distinguishes this program from another one with the same client name.
        alive = session.liveliness().declare_token(f"tvist/{ROBOT}/client/bare/{session.info.zid()}")
        token = ask(session, "command", type="take_control", client="bare", lease_s=30.0)["token"]
        q = next_state()["target_q"]
        ask(session, "command", type="servo_start", token=token, period=PERIOD, acceleration=4.0)
        setpoints = session.declare_publisher(f"tvist/{ROBOT}/setpoint", express=True)
        print(f"swinging {info['joints'][0]} of {ROBOT} by ±{AMPLITUDE} rad for {SECONDS:g} s …")
        start = time.monotonic()
        for sequence in range(round(SECONDS / PERIOD) + 1):
            # Deadlines count from the start, so that delays do not add up.
            time.sleep(max(0.0, start + sequence * PERIOD - time.monotonic()))
            wanted = [q[0] + swing(sequence * PERIOD), *q[1:]]
            setpoint = {"type": "setpoint", "token": token, "sequence": sequence, "q": wanted}
            setpoints.put(msgpack.packb(setpoint))
        ask(session, "command", type="servo_stop", token=token)
        stopped = ask(session, "info")["tick"]

        states = [next_state()]
        while states[-1]["tick"] <= stopped or states[-1]["runtime_state"] != 1:  # 1: stopped
            states.append(next_state())
        ask(session, "command", type="release_control", token=token)
        alive.undeclare()  # type: ignore[no-untyped-call]

    lag = delay([s["reference_q"][0] for s in states], [s["target_q"][0] for s in states])
    still = states[0]["actual_tool_accelerometer"]  # gravity only: a rotation of the base does not change it
    joint = max(abs(qdd) for s in states for qdd in s["target_qdd"])
    tool = max(math.dist(s["actual_tool_accelerometer"], still) for s in states)
    print(f"round trip              {trip:6.2f} ms, median; {answer:.2f} ms where the robot answers")
    print(f"reference_q → target_q  {1e3 * lag * TICK:6.2f} ms")
    print(
        f"largest acceleration    {joint:6.2f} rad/s² of a joint, {tool:.2f} m/s² at the tool, less gravity"
    )


if __name__ == "__main__":
    main()
