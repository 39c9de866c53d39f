"""The console logs stops and warnings, one line each and a limited number."""

import logging
import threading

from tvist_protocol.stream import EVENT_MEANINGS, Event
from tvist_server.gateways.console import STOPS, WARNINGS, WINDOW, Console, ConsoleGateway, Throttle

STOP = Event(tick=7, kind="protective_stop", code="limit_torque", why="torque of joint elbow")


def lines_of(console, caplog):
    console.start()
    console.close()
    console._thread.join()
    assert all(record.levelno >= logging.WARNING for record in caplog.records), "seen without any setting"
    return caplog.messages


def publish(console, *events):
    gateway = ConsoleGateway(console, "left", lambda command: f"tvist {command} --name left")
    for event in events:
        gateway.publish("event", event, b"")


def test_only_stops_and_warnings_are_logged_with_the_next_step(caplog):
    console = Console()
    publish(console, *(Event(tick=7, kind=kind, why=kind) for kind in EVENT_MEANINGS))
    lines = lines_of(console, caplog)
    assert len(lines) == 3
    assert "left: protective stop at tick 7: protective_stop. Next: tvist unlock --name left" in lines


def test_lines_are_limited_and_counted_separately_for_stops_and_warnings(caplog):
    console = Console()
    publish(console, *[Event(tick=1, kind="warning", why="doubt")] * 100, *[STOP] * 1000)
    lines = lines_of(console, caplog)
    assert sum("protective stop" in line for line in lines) == STOPS
    assert sum("doubt" in line for line in lines) == WARNINGS
    assert any(f"{1000 - STOPS} more stops" in line for line in lines)
    assert any(f"{100 - WARNINGS} more warnings" in line for line in lines)


def test_the_limit_of_lines_ends_with_its_window():
    throttle = Throttle(2, "stops")
    assert [throttle.take(str(n), 0.0) for n in range(4)] == [["0"], ["1"], [], []]
    assert throttle.due(WINDOW - 0.1) == []
    (count,) = throttle.due(WINDOW)
    assert count.startswith("2 more stops")
    assert throttle.due(WINDOW) == []
    assert throttle.take("5", WINDOW + 0.1) == ["5"]


def test_a_blocked_console_delays_neither_the_robot_nor_the_shutdown(monkeypatch):
    stuck = threading.Event()
    monkeypatch.setattr("tvist_server.gateways.console.log.warning", lambda *_: stuck.wait(60.0))
    console = Console()
    console.start()
    publish(console, *[STOP] * 1000)
    console.close()
    assert console._thread.is_alive(), "it still waits for its reader, and nobody for it"
    stuck.set()
    console._thread.join()
