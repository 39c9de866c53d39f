"""A client that knows only the protocol, written with eclipse-zenoh and msgpack."""

import math
import threading
from contextlib import contextmanager

import msgpack
from tests.conformance.session import plain_session
from zenoh.handlers import Callback

PATIENCE = 100.0
"""Longest wait for a message, on the slowest machine [s]."""
TICK = 0.002
STATE_FIELDS = {
    "type", "tick", "timestamp", "robot_mode", "safety_mode", "runtime_state", "setpoint_sequence", "reference_q",
    "target_q", "target_qd", "target_qdd", "target_moment", "actual_q", "actual_qd", "actual_moment",
    "actual_TCP_pose", "actual_TCP_speed", "actual_tool_accelerometer", "speed_scaling", "estimated_f_d",
    "estimated_zeta", "shaper_delay", "missed_ticks", "shaper_clipped", "unshaped_q",
    "unshaped_qd", "unshaped_qdd", "motor_qd", "motor_qdd", "motor_moment", "motor_limited",
    "flange_wrench",
}  # fmt: skip
Q1 = [0.0, -math.pi, 0.0, -math.pi / 2, 0.0, 0.0]
STOPPED, PLAYING = 1, 2


def _any(_):
    return True


class Wire:
    """A Zenoh session with one robot. Keeps every message of the topics it listens to."""

    def __init__(self, endpoint, robot="ur5e", settings=()):
        self.robot = robot
        self.received = {}
        self._news = threading.Condition()
        self._declared = []
        self.session = plain_session(endpoint, settings)

    def __enter__(self):
        return self

    def __exit__(self, *error):
        self.session.close()

    def key(self, leaf):
        return f"tvist/{self.robot}/{leaf}"

    # ---------------------------------------------------------------- what the robot puts

    def listen(self, *topics):
        for topic in topics:
            if topic in self.received:
                continue
            messages = self.received[topic] = []

            def take(sample, messages=messages):
                assert str(sample.encoding) == "application/msgpack"
                message = msgpack.unpackb(sample.payload.to_bytes())
                with self._news:
                    messages.append(message)
                    self._news.notify_all()

            direct = Callback(take, indirect=False)
            self._declared.append(self.session.declare_subscriber(self.key(topic), direct))
        return self

    def wait(self, topic, wanted=_any, *, since=0, timeout=PATIENCE):
        """Return the first wanted message from number `since` on; it may have come already."""
        messages, looked = self.received[topic], since
        found = None

        def there():
            nonlocal looked, found
            while looked < len(messages):
                message = messages[looked]
                looked += 1
                if wanted(message):
                    found = message
                    return True
            return False

        with self._news:
            if not self._news.wait_for(there, timeout):
                came = f"{len(messages)} came, the last {messages[-1:]}"
                raise AssertionError(f"no such {topic} within {timeout} s; {came}")
        return found

    def next(self, topic, wanted=_any, **options):
        """Return the first wanted message that comes from now on."""
        return self.wait(topic, wanted, since=len(self.received[topic]), **options)

    def state(self):
        self.listen("state")
        return self.next("state")

    def until(self, tick):
        """Return the state of a tick, or the first after it."""
        return self.wait("state", lambda state: state["tick"] >= tick)

    # ---------------------------------------------------------------- what a client sends

    def ask(self, key, payload=None, timeout=PATIENCE):
        """Return all replies to a query, decoded; each must be `reply` in MessagePack."""
        answers = []
        for reply in self.session.get(key, payload=payload, timeout=timeout):
            assert reply.ok is not None, f"answered by reply_err: {reply.err.payload.to_bytes()!r}"
            assert str(reply.ok.encoding) == "application/msgpack"
            answers.append(msgpack.unpackb(reply.ok.payload.to_bytes()))
        return answers

    def raw(self, payload):
        """Return the only answer to bytes on the command key."""
        (answer,) = self.ask(self.key("command"), payload)
        return answer

    def command(self, type, **fields):  # noqa: A002  the wire's name
        """Return the only answer to a command."""
        return self.raw(msgpack.packb({"type": type, **fields}))

    def begin(self, type, **fields):  # noqa: A002  the wire's name
        """Send a command without waiting; return the handler that gets its answer."""
        payload = msgpack.packb({"type": type, **fields})
        return self.session.get(self.key("command"), payload=payload, timeout=PATIENCE)

    def take(self, right, client):
        """Announce a client, take control or the clock for it, and return the token."""
        self.announce(client)
        taken = self.command(f"take_{right}", client=client)
        assert taken["type"] == "accepted", taken
        return taken["token"]

    def info(self):
        (answer,) = self.ask(self.key("info"))
        return answer

    def put(self, payload, leaf="setpoint"):
        self.session.put(self.key(leaf), payload)

    def setpoint(self, **fields):
        self.put(msgpack.packb({"type": "setpoint", **fields}))

    def announce(self, client):
        """Declare the liveliness token of a client."""
        self._declared.append(self.session.liveliness().declare_token(self.key(f"client/{client}")))

    # ---------------------------------------------------------------- control

    @contextmanager
    def control(self, client="wire", **fields):
        """Yield the token of control; at the end, reset the robot and release control."""
        answer = self.command("take_control", client=client, **fields)
        assert answer["type"] == "accepted", answer
        token = answer["token"]
        try:
            yield token
        finally:
            self.command("simulation.reset", token=token, q=Q1, seed=0, shaper="zv")
            self.command("release_control", token=token)

    def step(self, token, ticks, **fields):
        """Step time in lockstep; return the last state."""
        self.listen("state")
        answer = self.command("simulation.step", token=token, ticks=ticks, **fields)
        assert answer["type"] == "done", answer
        return self.until(answer["tick"])
