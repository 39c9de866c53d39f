"""A process with one liveliness token that does nothing; with a rate, it also puts 4 kB as often as that a second."""

import sys
import time

from tests.conformance.session import plain_session


def main(endpoint, key, rate):
    session = plain_session(endpoint)
    token = session.liveliness().declare_token(f"{key}/alive")
    sys.stdout.write("under way\n")
    sys.stdout.flush()
    publisher, payload = session.declare_publisher(f"{key}/state"), bytes(4096)
    due = time.monotonic()
    while token is not None:
        if not rate:
            time.sleep(1.0)
            continue
        for _ in range(int(rate / 100)):
            publisher.put(payload)
        due += 0.01
        time.sleep(max(0.0, due - time.monotonic()))


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2], float(sys.argv[3]))
