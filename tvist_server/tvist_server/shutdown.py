"""Orderly shutdown by a signal, or when the parent process dies."""

import contextlib
import faulthandler
import os
import signal
import sys
import threading
from collections.abc import Callable, Iterator
from types import FrameType

LONGEST = 4.5
"""Longest time for an orderly shutdown [s]."""


def ending_signals() -> list[signal.Signals]:
    """Return the signals that shut this process down: not SIGHUP if it is ignored, as after `nohup`."""
    ends = [signal.SIGINT, signal.SIGTERM, signal.SIGQUIT]
    if signal.getsignal(signal.SIGHUP) is not signal.SIG_IGN:
        ends.append(signal.SIGHUP)
    return ends


def end_like_interrupted() -> None:
    """Let the other shutdown signals act as Control+C; a second signal ends the process at once."""

    def interrupt(number: int, _frame: FrameType | None) -> None:
        signal.signal(number, signal.SIG_DFL)
        if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:  # a background job of a script
            signal.signal(signal.SIGINT, signal.default_int_handler)
        signal.raise_signal(signal.SIGINT)

    for number in ending_signals():
        if number != signal.SIGINT:
            signal.signal(number, interrupt)


def limit_shutdown() -> None:
    """End this process within `LONGEST`, even if a thread holds the interpreter's lock; stderr shows what hangs."""
    faulthandler.dump_traceback_later(LONGEST, exit=True, file=2)


def end_with_parent() -> None:
    """End this child process of `multiprocessing` when its parent dies, even by SIGKILL."""
    import multiprocessing.connection

    parent = multiprocessing.parent_process()
    assert parent is not None

    def end() -> None:
        multiprocessing.connection.wait([parent.sentinel])
        os._exit(1)

    threading.Thread(target=end, name="tvist-parent", daemon=True).start()


class SignalExit(SystemExit):
    """Exit because of a signal; distinct from a SystemExit that a user's file raises."""


class Shutdown:
    """A shutdown that a signal requests. Construct it in the main thread.

    From then on, signals do not end the process directly. The first one requests the shutdown, which
    `at_once` or `on_request` carries out. Later ones are ignored so that they cannot interrupt it; after `LONGEST`
    the process ends in any case.
    """

    def __init__(self) -> None:
        self._numbers = ending_signals()
        self._received: int | None = None
        self._raises = False
        self._call: Callable[[], object] | None = None
        for number in self._numbers:
            signal.signal(number, self._on_signal)

    @contextlib.contextmanager
    def at_once(self) -> Iterator[None]:
        """Let a signal raise in the body: KeyboardInterrupt for SIGINT, else SystemExit with code 0."""
        self._raises = True
        try:
            if self._received is not None:
                self._raise(self._received)
            yield
        finally:
            self._raises = False

    def on_request(self, call: Callable[[], object]) -> None:
        """Set what the main thread calls at a signal (now if one has come); it may raise RuntimeError."""
        self._call = call
        if self._received is not None:
            call()

    def request(self) -> None:
        """Request the shutdown, from any thread, after `on_request`."""
        if self._call is not None:
            with contextlib.suppress(RuntimeError):  # the loop is closed: the shutdown is over
                self._call()

    @property
    def signal(self) -> signal.Signals | None:
        """The signal that requested the shutdown; None if none did."""
        return None if self._received is None else signal.Signals(self._received)

    def close(self) -> None:
        """Ignore the signals until the process ends, because the interpreter removes its handlers earlier."""
        report = sys.unraisablehook

        def report_others(unraisable: "sys.UnraisableHookArgs") -> None:
            # Python reports a signal that arrives while its handler is being replaced.
            if "ignored due to race condition" not in str(unraisable.exc_value):
                report(unraisable)

        sys.unraisablehook = report_others
        for number in self._numbers:
            signal.signal(number, signal.SIG_IGN)

    def _on_signal(self, number: int, _frame: FrameType | None) -> None:
        if self._received is not None:
            return
        self._received = number
        limit_shutdown()
        if self._raises:
            self._raise(number)
        else:
            self.request()

    def _raise(self, number: int) -> None:
        if number == signal.SIGINT:
            raise KeyboardInterrupt
        raise SignalExit(0)
