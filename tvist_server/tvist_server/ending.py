"""Orderly shutdown on the signals SIGINT, SIGTERM, SIGHUP and SIGQUIT, and of processes whose parent has died."""

import contextlib
import faulthandler
import os
import signal
import sys
import threading
from collections.abc import Callable, Iterator
from types import FrameType

LONGEST = 4.5
"""Longest time in which a shutdown may do its work in order [s]."""


def ending_signals() -> list[signal.Signals]:
    """Return the signals that shut this process down.

    SIGHUP is left out if it is already ignored: a process started with `nohup` must outlive the terminal.
    """
    ends = [signal.SIGINT, signal.SIGTERM, signal.SIGQUIT]
    if signal.getsignal(signal.SIGHUP) is not signal.SIG_IGN:
        ends.append(signal.SIGHUP)
    return ends


def end_like_interrupted() -> None:
    """Let the other signals that shut this process down do what Control+C does; a second one ends it at once."""

    def interrupt(number: int, _frame: FrameType | None) -> None:
        signal.signal(number, signal.SIG_DFL)
        if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:  # as in a script's background
            signal.signal(signal.SIGINT, signal.default_int_handler)
        signal.raise_signal(signal.SIGINT)

    for number in ending_signals():
        if number != signal.SIGINT:
            signal.signal(number, interrupt)


def limit_shutdown() -> None:
    """End this process in `LONGEST`, also if a thread keeps the interpreter's lock; stderr shows what hangs."""
    faulthandler.dump_traceback_later(LONGEST, exit=True, file=2)


def end_with_parent() -> None:
    """End this process, which `multiprocessing` has started, as soon as its parent has died, even of SIGKILL."""
    import multiprocessing.connection

    parent = multiprocessing.parent_process()
    assert parent is not None

    def end() -> None:
        multiprocessing.connection.wait([parent.sentinel])
        os._exit(1)

    threading.Thread(target=end, name="tvist-parent", daemon=True).start()


class SignalExit(SystemExit):
    """A signal's exit, which code that takes an exit for a failure can tell from one of somebody's file."""


class Ending:
    """A shutdown requested by a signal.

    Once this is constructed, in the main thread, signals no longer end the process by themselves. The first signal
    requests a shutdown, which `at_once` or `hear` carries out; further signals are ignored, so that they cannot
    interrupt it. After `LONGEST` the process ends in any case.
    """

    def __init__(self) -> None:
        self._numbers = ending_signals()
        self._wish: int | None = None
        self._raises = False
        self._heard: Callable[[], object] | None = None
        for number in self._numbers:
            signal.signal(number, self._on_signal)

    @contextlib.contextmanager
    def at_once(self) -> Iterator[None]:
        """While the body runs, let a signal raise an exception there, so that the body can clean up.

        Raises:
            SystemExit: A signal other than SIGINT has come; exit code 0.
            KeyboardInterrupt: SIGINT has come.
        """
        self._raises = True
        try:
            if self._wish is not None:
                self._raise(self._wish)
            yield
        finally:
            self._raises = False

    def hear(self, heard: Callable[[], object]) -> None:
        """Set a function to call in the main thread when a signal comes, or now if one has come already.

        Args:
            heard: The function; it may raise RuntimeError if the shutdown is already over.
        """
        self._heard = heard
        if self._wish is not None:
            heard()

    def request(self) -> None:
        """Request the shutdown from within the process; callable from any thread once `hear` was called."""
        if self._heard is not None:
            with contextlib.suppress(RuntimeError):  # the loop is closed: it has ended already
                self._heard()

    @property
    def signal(self) -> signal.Signals | None:
        """The signal that requested the shutdown; None if none did."""
        return None if self._wish is None else signal.Signals(self._wish)

    @property
    def interrupted(self) -> bool:
        """Whether Control+C requested the shutdown."""
        return self._wish == signal.SIGINT

    def close(self) -> None:
        """Ignore the signals until the process ends, since the interpreter removes its handlers before that."""
        report = sys.unraisablehook

        def report_others(unraisable: "sys.UnraisableHookArgs") -> None:
            # Python reports a signal that comes just when it begins to be ignored.
            if "ignored due to race condition" not in str(unraisable.exc_value):
                report(unraisable)

        sys.unraisablehook = report_others
        for number in self._numbers:
            signal.signal(number, signal.SIG_IGN)

    def _on_signal(self, number: int, _frame: FrameType | None) -> None:
        if self._wish is not None:
            return
        self._wish = number
        limit_shutdown()
        if self._raises:
            self._raise(number)
        else:
            self.request()

    def _raise(self, number: int) -> None:
        if number == signal.SIGINT:
            raise KeyboardInterrupt
        raise SignalExit(0)
