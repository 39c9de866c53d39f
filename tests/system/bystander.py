"""A client that has nothing to do with what goes wrong, and must not notice."""

import math
from itertools import pairwise

from tests.conformance.wire import Wire


class Bystander(Wire):
    """Sees every state and event of a robot, over a connection of its own."""

    def __enter__(self):
        self.listen("state", "event", "telemetry")
        self.since = self.next("state")["tick"]
        return self

    def until_later(self, ticks=0):
        """Let ticks pass; the state after them."""
        return self.until(self.received["state"][-1]["tick"] + ticks)

    def event(self, kind, **options):
        """The first event of a kind since this began to look."""
        return self.wait(
            "event", lambda event: event["kind"] == kind and event["tick"] > self.since, **options
        )

    def assert_undisturbed(self, ticks=100):
        """States have come, in order and sound, and go on coming; a question is answered.

        A machine that is too busy for all of them loses some, but never most.
        """
        assert self.info()["name"] == self.robot
        self.until_later(ticks)
        states = [state for state in self.received["state"] if state["tick"] >= self.since]
        seen = [state["tick"] for state in states]
        assert all(after > before for before, after in pairwise(seen))
        assert 10 * len(seen) > seen[-1] - seen[0], f"{len(seen)} states of {seen[-1] - seen[0]} ticks came"
        assert all(math.isfinite(number) for state in states for number in state["actual_q"])
