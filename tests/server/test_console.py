"""Stops and warnings stand on the server's console, a line each, and a flood of them does not flood it."""

import logging
import threading

import pytest

from tvist_protocol.stream import EVENT_MEANINGS, Event
from tvist_server.gateways.console import STOPS, WARNINGS, WINDOW, Console, ConsoleGateway, Throttle

STOP = Event(tick=7, kind="protective_stop", code="limit_torque", why="torque of joint elbow")


@pytest.fixture
def said(caplog):
    """The lines of a console that was closed."""

    def said(console):
        console.start()
        console.close()
        console._thread.join()
        assert all(record.levelno >= logging.WARNING for record in caplog.records), "seen without any setting"
        return [record.getMessage() for record in caplog.records]

    return said


def publish(console, *events):
    gateway = ConsoleGateway(console, "left", lambda command: f"tvist {command} --name left")
    for event in events:
        gateway.publish("event", event, b"")


def test_stops_and_warnings_are_lines_with_what_to_do_and_what_is_everyday_is_not_told(said):
    console = Console()
    publish(console, *(Event(tick=7, kind=kind, why=kind) for kind in EVENT_MEANINGS))
    lines = said(console)
    assert len(lines) == 3
    assert "left: protective stop at tick 7: protective_stop. Next: tvist unlock --name left" in lines


def test_a_flood_is_cut_off_and_counted_and_warnings_take_no_room_of_stops(said):
    console = Console()
    publish(console, *[Event(tick=1, kind="warning", why="doubt")] * 100, *[STOP] * 1000)
    lines = said(console)
    assert sum("protective stop" in line for line in lines) == STOPS
    assert sum("doubt" in line for line in lines) == WARNINGS
    assert any(f"{1000 - STOPS} more stops" in line for line in lines)
    assert any(f"{100 - WARNINGS} more warnings" in line for line in lines)


def test_after_a_while_lines_come_through_again_behind_the_count_of_those_left_out():
    throttle = Throttle(2, "stops")
    assert [throttle.take(str(n), 0.0) for n in range(4)] == [["0"], ["1"], [], []]
    assert throttle.due(WINDOW - 0.1) == []
    (count,) = throttle.due(WINDOW)
    assert count.startswith("2 more stops")
    assert throttle.due(WINDOW) == []
    assert throttle.take("5", WINDOW + 0.1) == ["5"]


def test_a_console_that_nobody_reads_holds_up_neither_the_robot_nor_the_end(monkeypatch):
    stuck = threading.Event()
    monkeypatch.setattr("tvist_server.gateways.console.log.warning", lambda *_: stuck.wait(60.0))
    console = Console()
    console.start()
    publish(console, *[STOP] * 1000)
    console.close()
    assert console._thread.is_alive(), "it still waits for its reader, and nobody for it"
    stuck.set()
    console._thread.join()
