"""What judges the signals of a tick has one interface, and is on one list."""

import pytest

from tvist_controller.motion.monitor import Finding, Monitor
from tvist_protocol import commands as c
from tvist_protocol.replies import Done
from tvist_protocol.simulation import SimulationInject, SimulationReset

from .robots import Q2, Robot


class Alarm(Monitor):
    """Finds something in one tick."""

    def __init__(self, then="warning"):
        self.then, self.looked, self.restarts = then, 0, 0

    def look(self, _):
        self.looked += 1
        return Finding("it rings", "limit_force", self.then) if self.looked == 50 else None

    def restart(self):
        self.restarts += 1


class WhileHeld(Alarm):
    needs = "drives"


def with_monitor(monitor):
    robot = Robot()
    safety = robot.controller.safety
    safety.monitors = (*safety.monitors, monitor)
    return robot


@pytest.mark.parametrize(
    ("then", "kinds"),
    [
        ("warning", ["motion_started", "warning", "motion_done"]),
        ("interruption", ["motion_started", "motion_stopped"]),
        ("protective_stop", ["motion_started", "protective_stop", "motion_stopped"]),
    ],
)
def test_a_finding_leads_to_what_it_names(then, kinds):
    robot = with_monitor(Alarm(then))
    robot.send(c.MoveJ, q=tuple(Q2))
    robot.tick(2000)
    told = [event for event in robot.events if event.kind in kinds]
    assert [event.kind for event in told] == kinds
    assert (told[1].why, told[1].code, told[1].tick) == ("it rings", "limit_force", 50)


def test_a_monitor_looks_while_it_has_what_it_needs_and_begins_anew_when_the_drives_hold_the_arm():
    always, held = Alarm(), WhileHeld()
    robot = with_monitor(always)
    safety = robot.controller.safety
    safety.monitors = (*safety.monitors, held)
    robot.tick(10)
    assert (always.looked, held.looked, held.restarts) == (10, 10, 0)
    assert robot.send(c.PowerOff) == Done()
    robot.tick(10)
    seen, restarts = held.looked, held.restarts
    robot.tick(10)
    assert (always.looked, held.looked) == (30, seen)
    robot.send(c.PowerOn)
    robot.tick(10)
    assert (held.looked, held.restarts) == (seen + 10, restarts + 1)
    robot.send(SimulationReset, q=tuple(Q2))
    assert held.restarts == restarts + 2


def test_what_was_found_before_an_unlock_does_not_count_again():
    held = WhileHeld()
    robot = with_monitor(held)
    robot.send(SimulationInject, fault="protective_stop")
    robot.tick(100)
    before = held.restarts
    assert robot.send(c.UnlockProtectiveStop) == Done()
    assert held.restarts == before + 1
