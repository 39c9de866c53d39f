"""Watches a network for a test, from inside a network namespace; one JSON line for whatever happens.

Arguments: endpoint, seconds. Tokens come as {at, there, key}; once a second {at, states, gaps} says how many states of
each robot came and the 99th percentile of the time between two of them [s]; events as {at, key, kind, why}.
"""

import itertools
import json
import sys
import threading
import time
from collections import defaultdict

import msgpack
import zenoh
from tests.conformance.session import plain_session
from zenoh.handlers import Callback

_lock = threading.Lock()
_came = defaultdict(list)


def tell(**what):
    with _lock:
        sys.stdout.write(json.dumps({"at": time.monotonic(), **what}) + "\n")
        sys.stdout.flush()


def on_token(sample):
    tell(there=sample.kind == zenoh.SampleKind.PUT, key=str(sample.key_expr))


def on_state(sample):
    _came[str(sample.key_expr)].append(time.monotonic())


def on_event(sample):
    message = msgpack.unpackb(sample.payload.to_bytes())
    tell(key=str(sample.key_expr), kind=message["kind"], why=message["why"])


def main(endpoint, seconds):
    session = plain_session(endpoint)
    declared = [
        session.liveliness().declare_subscriber("**/alive", Callback(on_token, indirect=False), history=True),
        session.declare_subscriber("**/tvist/*/state", Callback(on_state, indirect=False)),
        session.declare_subscriber("**/tvist/*/event", Callback(on_event, indirect=False)),
    ]
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        time.sleep(1.0)
        seen = {key: times[:] for key, times in _came.items()}
        _came.clear()
        gaps = {}
        for key, times in seen.items():
            between = sorted(later - earlier for earlier, later in itertools.pairwise(times))
            if between:
                gaps[key] = between[int(0.99 * (len(between) - 1))]
        tell(states={key: len(times) for key, times in seen.items()}, gaps=gaps)
    del declared
    session.close()


if __name__ == "__main__":
    main(sys.argv[1], float(sys.argv[2]))
