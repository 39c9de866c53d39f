"""Compile the robot's computations and show the progress."""

import time
from collections.abc import Callable

from tvist_cli.output import err, progress, say

SAY_EVERY = 10.0  # shortest time between two lines about progress where stderr is no terminal [s]


def compile_if_new(tell: Callable[[int, int], None] = lambda *_: None) -> None:
    """Compile kernels not on disk and show progress; `tell` gets the numbers of compiled and all kernels."""
    from tvist_server.kernels import KERNELS, KernelsError, compiled

    done = compiled()
    tell(done, len(KERNELS))
    if done == len(KERNELS):
        return
    say("compiling what a robot computes for this processor; this happens once and takes up to a minute")
    try:
        compile_shown(None, tell)
    except KernelsError as error:  # the robot can still compile kernels itself
        say(f"warning: the next start compiles again: {error}")


def compile_shown(processes: int | None, tell: Callable[[int, int], None] = lambda *_: None) -> None:
    """Compile kernels in advance by `tvist_server.kernels`, and show progress as a bar or in lines."""
    from tvist_server.kernels import KERNELS, compile_ahead

    said, shown = time.monotonic(), 0
    with progress(len(KERNELS), "kernels", "the next start continues") as advance:

        def show(done: int, total: int) -> None:
            nonlocal said, shown
            tell(done, total)
            advance(done - shown)
            if not err.is_terminal and done > shown and time.monotonic() - said >= SAY_EVERY:
                say(f"{done} of {total} kernels are compiled")
                said = time.monotonic()
            shown = done

        compile_ahead(processes, show)
