"""Signals wait where nothing may be half done."""

import signal
import threading

import pytest

from tvist_server.ending import signals_held


@pytest.fixture(autouse=True)
def raising():
    """SIGTERM raises here, and is what it was before after the test."""

    def interrupt(*_):
        raise KeyboardInterrupt

    before = signal.signal(signal.SIGTERM, interrupt)
    yield interrupt
    signal.signal(signal.SIGTERM, before)


def test_a_signal_waits_until_the_body_is_through(raising):
    did = []

    def interrupted():
        with signals_held():
            signal.raise_signal(signal.SIGTERM)
            did.append("all of it")

    with pytest.raises(KeyboardInterrupt):
        interrupted()
    assert did == ["all of it"]
    assert signal.getsignal(signal.SIGTERM) is raising


def test_an_error_of_the_body_leaves_the_handlers_as_they_were(raising):
    with pytest.raises(ZeroDivisionError), signals_held():
        _ = 1 / 0
    assert signal.getsignal(signal.SIGTERM) is raising


def test_threads_that_hear_no_signals_pass(raising):
    def held():
        with signals_held():
            seen.append(signal.getsignal(signal.SIGTERM))

    seen = []
    thread = threading.Thread(target=held)
    thread.start()
    thread.join()
    assert seen == [raising]
