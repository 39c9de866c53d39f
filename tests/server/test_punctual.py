"""What is asked of the system: it is granted, or refused in one sentence, and the robot runs in either case."""

import os
import resource
import subprocess
import sys
import threading

import pytest

from tvist_server import punctual

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="asked of Linux")


def in_a_thread(function, *arguments):
    found = []
    thread = threading.Thread(target=lambda: found.extend((function(*arguments), os.sched_getaffinity(0))))
    thread.start()
    thread.join()
    return found


def test_a_thread_is_bound_to_a_processor_and_its_parent_is_not():
    before = os.sched_getaffinity(0)
    assert in_a_thread(punctual.bind, min(before)) == [True, {min(before)}]
    assert os.sched_getaffinity(0) == before


def test_a_processor_that_is_not_there_is_named_and_the_thread_runs_anywhere(caplog):
    assert in_a_thread(punctual.bind, 4095) == [False, os.sched_getaffinity(0)]
    (record,) = caplog.records
    assert "cannot be bound to processor 4095" in record.getMessage()


def test_a_thread_knows_how_long_it_has_waited_for_a_processor():
    def wait():
        punctual.bind(min(os.sched_getaffinity(0)))
        with subprocess.Popen([sys.executable, "-c", "while True: pass"]) as busy:  # on the same processor
            while punctual.waited_us() < 1e4:
                pass
            busy.kill()

    in_a_thread(wait)


def test_other_threads_leave_a_processor_only_if_there_is_another(monkeypatch, caplog):
    moved = []
    monkeypatch.setattr(os, "sched_setaffinity", lambda _, where: moved.append(where))
    monkeypatch.setattr(os, "sched_getaffinity", lambda _: {0, 1, 2})
    assert punctual.leave_processor(1)
    assert moved
    assert all(where == {0, 2} for where in moved)
    monkeypatch.setattr(os, "sched_getaffinity", lambda _: {1})
    assert not punctual.leave_processor(1)
    assert "is the only one" in caplog.text


def test_memory_that_a_limit_would_let_be_locked_in_part_is_not_locked(monkeypatch, caplog):
    """Otherwise an allocation would fail later, in the middle of a motion."""
    monkeypatch.setattr(resource, "getrlimit", lambda _: (8 << 20, 8 << 20))
    monkeypatch.setattr(punctual, "_may_lock_all", lambda: False)
    monkeypatch.setattr(punctual.ctypes, "CDLL", lambda *_, **__: pytest.fail("it was asked for"))
    assert not punctual.lock_memory()
    assert "8192 kB" in caplog.text
