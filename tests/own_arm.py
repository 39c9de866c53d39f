"""A plant of a third party: it has a posture, a clock, power, brakes and faults of its own."""

import time

import numpy as np

from tvist_plant.plant import PERIOD, Condition, Measurement, PlantError

STANDS = np.array([0.3, -1.2, 1.5, -1.8, -1.5, 0.2])
SWITCHES = 10  # ticks that switching power and brakes takes


class OwnArm:
    """Its drives follow commands exactly while they have power and the brakes are released."""

    def __init__(self, description, payload):
        self.payload = payload
        self.q, self.qd = STANDS[: description.joints].copy(), np.zeros(description.joints)
        self.fault, self.silent, self.stops, self.calls = None, False, 0, []
        self._wanted, self._left, self._ticks = (False, True), 0, 0
        self._due = time.monotonic()

    @property
    def condition(self):
        return Condition(self._wanted == (True, False) and self._left == 0, self.fault)

    def switch(self, *, power, brakes):
        self.calls.append((power, brakes))
        self._wanted, self._left = (power, brakes), SWITCHES

    def stop(self):
        self.stops += 1
        self._wanted, self._left = (False, True), 0

    def wait(self, timeout):
        left = self._due + PERIOD - time.monotonic()
        time.sleep(max(min(left, timeout), 0.0))
        if left > timeout:
            return False
        self._due = max(self._due + PERIOD, time.monotonic() - PERIOD)
        return True

    def step(self, command):
        if self.silent:
            raise PlantError("the arm does not answer")
        self._ticks += 1
        if self.condition.ready:
            self.q, self.qd = command.q.copy(), command.qd.copy()
        else:
            self._left, self.qd = max(self._left - 1, 0), np.zeros_like(self.q)
        return self.measure()

    def measure(self):
        time, gravity = self._ticks * PERIOD, np.array([0.0, 0.0, 9.81])
        return Measurement(self.q, self.qd, np.zeros_like(self.q), gravity, timestamp=time)
