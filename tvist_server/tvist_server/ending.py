"""Signals that end a process in order: SIGINT, SIGTERM, SIGHUP and SIGQUIT."""

import contextlib
import signal
from collections.abc import Callable, Iterator
from types import FrameType


def ending_signals() -> list[signal.Signals]:
    """Signals that shall end this process in order.

    SIGHUP is not among them where it is ignored already: whoever starts a process with `nohup` wants it to outlive
    the terminal.
    """
    ends = [signal.SIGINT, signal.SIGTERM, signal.SIGQUIT]
    if signal.getsignal(signal.SIGHUP) is not signal.SIG_IGN:
        ends.append(signal.SIGHUP)
    return ends


class Ending:
    """The wish of a signal that this process end.

    From its construction on, in the main thread, signals end nothing by themselves. The first one is a wish, which
    `at_once` or `hear` grants; further ones do nothing, so that none of them spoils the end.
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
        """Raise what ends the process, wherever it is, while the body runs: something to clean up, nothing to finish.

        Raises:
            SystemExit: A signal has come; exit code 0.
            KeyboardInterrupt: It was SIGINT.
        """
        self._raises = True
        try:
            if self._wish is not None:
                self._raise(self._wish)
            yield
        finally:
            self._raises = False

    def hear(self, heard: Callable[[], object]) -> None:
        """Have something called, in the main thread, once a signal has come; at once where one has come already.

        Args:
            heard: May raise RuntimeError where the wish comes too late.
        """
        self._heard = heard
        if self._wish is not None:
            heard()

    @property
    def interrupted(self) -> bool:
        """Whether Control+C was the wish."""
        return self._wish == signal.SIGINT

    def close(self) -> None:
        """Ignore the signals to the end of the process, when the interpreter takes its handlers away."""
        for number in self._numbers:
            signal.signal(number, signal.SIG_IGN)

    def _on_signal(self, number: int, _frame: FrameType | None) -> None:
        if self._wish is not None:
            return
        self._wish = number
        if self._raises:
            self._raise(number)
        elif self._heard is not None:
            with contextlib.suppress(RuntimeError):  # the loop is closed: it has ended already
                self._heard()

    def _raise(self, number: int) -> None:
        if number == signal.SIGINT:
            raise KeyboardInterrupt
        raise SystemExit(0)
