"""A client that a fault must not disturb."""

import math
from itertools import pairwise

from tests.conformance.wire import Wire


class Bystander(Wire):
    """Receives all states and events of a robot over its own connection."""

    def __enter__(self):
        self.listen("state", "event", "telemetry")
        self.since = self.next("state")["tick"]
        return self

    def until_later(self, ticks=0):
        """Wait for a number of ticks; return the state after them."""
        return self.until(self.received["state"][-1]["tick"] + ticks)

    def event(self, kind, after=0):
        """Return the first event of a kind since the connection, or after a later tick."""
        after = max(after, self.since)
        return self.wait("event", lambda event: event["kind"] == kind and event["tick"] > after)

    def assert_undisturbed(self, ticks=100):
        """States came in order, are finite and continue to come; a query is answered.

        A busy machine loses some states, but never most of them.
        """
        assert self.info()["name"] == self.robot
        self.until_later(ticks)
        states = [state for state in self.received["state"] if state["tick"] >= self.since]
        seen = [state["tick"] for state in states]
        assert all(after > before for before, after in pairwise(seen))
        assert 10 * len(seen) > seen[-1] - seen[0], f"{len(seen)} states of {seen[-1] - seen[0]} ticks came"
        assert all(math.isfinite(number) for state in states for number in state["actual_q"])
