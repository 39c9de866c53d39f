"""A process that sends a robot messages of every kind: `python -m tvist_lab.benchmark.sender ENDPOINT RATE SEED`.

It first takes control, then prints `ready`; it ends when its stdin is closed.
"""

import sys
import threading
import time

import zenoh
from zenoh.handlers import Callback

from tvist_client.transports.session import open_session
from tvist_controller.api import load_calibration
from tvist_lab.benchmark.messages import Messages
from tvist_protocol import keys
from tvist_protocol.codec import decode_reply, encode
from tvist_protocol.commands import TakeControl
from tvist_protocol.replies import Accepted

ROBOT = "ur5e"
MADE = 500
"""Number of messages that are created in advance and sent in turn."""


def main() -> None:
    """Send messages until stdin is closed."""
    endpoint, rate, seed = sys.argv[1], float(sys.argv[2]), int(sys.argv[3])
    session = open_session(endpoint)
    command = keys.command(ROBOT)
    taken = decode_reply(_ask(session, command, encode(TakeControl(client="sender", lease_s=3600.0))))
    assert isinstance(taken, Accepted), taken
    source = Messages(seed, str(taken.token), load_calibration("ur5e_5kg"))
    messages = [source.next() for _ in range(MADE)]
    ended = threading.Event()
    threading.Thread(target=_until_closed, args=(ended,), daemon=True).start()
    sys.stdout.write("ready\n")
    sys.stdout.flush()
    began, number = time.monotonic(), 0
    while not ended.wait(max(0.0, began + number / rate - time.monotonic())):
        data = messages[number % MADE]
        if number % 5 == 0:
            session.put(keys.setpoint(ROBOT), data)
        else:
            session.get(command, Callback(_forget, indirect=False), payload=data, timeout=10.0)
        number += 1
    session.close()  # type: ignore[no-untyped-call]


def _until_closed(ended: threading.Event) -> None:
    sys.stdin.read()
    ended.set()


def _ask(session: zenoh.Session, key: str, data: bytes) -> bytes:
    for reply in session.get(key, payload=data, timeout=10.0):
        if reply.ok is not None:
            return bytes(reply.ok.payload.to_bytes())
    raise SystemExit(f"nobody answers on {key}")


def _forget(_: zenoh.Reply) -> None:
    """Ignore the reply."""


if __name__ == "__main__":
    main()
