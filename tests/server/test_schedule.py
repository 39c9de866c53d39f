"""Deadlines of several robots in one thread, on a clock that is a number."""

import re
from fractions import Fraction

import pytest

from tvist_server.schedule import CATCH_UP, Schedule
from tvist_server.tick_counts import TickCounts

PERIOD = 0.002


def played(robots, ticks, start=1000.0, delay=lambda _: 0.0):
    """Return robot, start, lateness and missed ticks of each tick, which starts `delay` after it is due."""
    schedule, now, begun = Schedule(robots, PERIOD, start), start, []
    for number in range(ticks):
        now = max(now, schedule.due) + delay(number)
        begun.append((*schedule.begin(now), now))
    return [(robot, now, late, missed) for robot, late, missed, now in begun]


@pytest.mark.parametrize("robots", [1, 5])
def test_all_robots_tick_in_turn_once_a_period(robots):
    begun = played(robots, 20 * robots)
    assert [robot for robot, *_ in begun] == list(range(robots)) * 20
    due = [1000.0 + PERIOD * (1 + tick // robots) for tick in range(20 * robots)]
    assert [now for _, now, *_ in begun] == pytest.approx(due, abs=1e-9)
    assert all(late == 0.0 and missed == 0 for _, _, late, missed in begun)


@pytest.mark.parametrize("robots", [2, 16])
def test_robots_within_their_share_tick_after_one_wake_up(robots):
    schedule, now, woken = Schedule(robots, PERIOD, 0.0), 0.0, 0
    for _ in range(20 * robots):
        woken += schedule.due > now
        now = max(now, schedule.due)
        assert schedule.begin(now)[1:] == (pytest.approx(0.0, abs=1e-9), 0)
        now += 0.9 * PERIOD / robots
    assert woken == 20


def test_missed_ticks_are_counted_for_each_robot():
    """After a pause of 5.5 periods, ticks that begin a period late or more count as missed, and no others."""
    robots, delay = 4, 5.5 * PERIOD
    begun = played(robots, 40 * robots, delay=lambda number: delay if number == 10 * robots else 0.0)
    for robot in range(robots):
        own = [(late, missed) for number, _, late, missed in begun if number == robot]
        assert all(missed == (late >= PERIOD) for late, missed in own)
        # The first is late by the delay less its part of the period, each next one by a period less.
        expected = int(Fraction(11, 2) - Fraction(robot, robots))
        assert sum(missed for _, missed in own) == expected


@pytest.mark.parametrize("robots", [1, 5])
def test_at_most_fifty_ticks_are_made_up_for_after_a_delay(robots):
    periods = 200
    begun = played(robots, robots * 300, delay=lambda number: periods * PERIOD if number == robots else 0.0)
    for robot in range(robots):
        own = [(now, late, missed) for number, now, late, missed in begun if number == robot]
        burst = [late for _, late, _ in own if late >= PERIOD]
        assert len(burst) <= CATCH_UP + 1
        # Every period between two ticks is accounted for: it was ticked, or it was left out and counted.
        assert sum(missed for *_, missed in own) == pytest.approx(periods, abs=1)
        assert own[-1][1] == 0.0


def test_deadlines_do_not_drift():
    robots, start = 3, 1e6
    schedule, ticks = Schedule(robots, PERIOD, start), 90_000
    for _ in range(ticks):
        schedule.begin(schedule.due)
    assert schedule.due == pytest.approx(start + PERIOD * (1 + ticks / robots), abs=1e-5)


def loaded(overload, schedule, now, seconds, takes):
    """Tick for some seconds; return the messages with their times, the number of ticks, and the time."""
    said, ticks, until = [], 0, now + seconds
    while now < until:
        now = max(now, schedule.due)
        told = overload.note(schedule.begin(now)[2])
        said += [] if told is None else [(now, told)]
        now += takes
        ticks += 1
    return said, ticks, now


@pytest.mark.parametrize(("periods", "speed"), [(1.25, 1.0), (8.3, 10.0), (350.0, 0.5)])
def test_due_ticks_follow_the_wall_clock_and_bound_the_missed_ones(periods, speed):
    period = PERIOD / speed
    takes = periods * period
    overload, start = TickCounts(period), 1000.0
    _, ticks, now = loaded(overload, Schedule(1, period, start), start, 60.0, takes)
    assert ticks <= overload.due
    assert 0.9 * overload.due < overload.missed <= overload.due
    behind = (CATCH_UP + 1) * period + takes
    assert now - start - behind <= overload.due * period <= now - start


def test_an_overload_begins_after_two_bad_and_ends_after_five_good_seconds():
    overload, schedule, now = TickCounts(PERIOD), Schedule(1, PERIOD, 0.0), 0.0
    said, _, now = loaded(overload, schedule, now, 30.0, 1 / 60)
    ((when, why),) = said
    assert 2.0 <= when < 2.5
    assert overload.overloaded
    missed, due = map(int, re.findall(r"(\d+) of the (\d+) control periods", why)[0])
    assert 500 <= due < 600
    assert 0.9 * due < missed <= due
    assert "Next: end other programs" in why
    said, _, now = loaded(overload, schedule, now, 30.0, 0.0)
    ((when, why),) = said
    assert 35.0 <= when < 36.5
    assert not overload.overloaded
    assert "no longer overloaded" in why


def test_overload_has_hysteresis():
    """Missing a tenth of the ticks neither starts nor ends an overload."""

    def second(overload, missed):
        return [told for tick in range(500) if (told := overload.note(int(tick < missed))) is not None]

    overload = TickCounts(PERIOD)
    assert not any(second(overload, 50) for _ in range(20))
    assert [bool(second(overload, 100)) for _ in range(2)] == [False, True]
    assert not any(second(overload, 50) for _ in range(20))
    told = [bool(second(overload, missed)) for missed in (*[24] * 4, 25, *[24] * 5)]
    assert told == [False] * 9 + [True]
