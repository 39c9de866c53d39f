"""What the commands that serve a robot have in common."""

import os
import time
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

from tvist_cli.output import err, progress, say

if TYPE_CHECKING:
    from tvist_controller.setup import Setup
    from tvist_server.config import ServeConfig
    from tvist_server.server import Recording, Server
    from tvist_server.workers import Workers


BEGAN = time.monotonic()
"""When this program began, nearly: what takes long to import comes after."""
SAY_EVERY = 10.0
"""Shortest time between two lines about progress where stderr is no terminal [s]."""


def compile_if_new(tell: Callable[[int, int], None] = lambda *_: None) -> None:
    """Compile what is not on disk yet, on all processors, and show how far that is, since it takes long.

    Args:
        tell: Called with the number of kernels that are compiled, and of all.
    """
    from tvist_server.kernels import KERNELS, KernelsError, compiled

    done = compiled()
    tell(done, len(KERNELS))
    if done == len(KERNELS):
        return
    say("compiling what a robot computes for this processor; this happens once and takes up to a minute")
    try:
        compile_shown(None, tell)
    except KernelsError as error:  # the robot compiles for itself
        say(f"warning: the next start compiles again: {error}")


def compile_shown(processes: int | None, tell: Callable[[int, int], None] = lambda *_: None) -> None:
    """Compile ahead as `tvist_server.kernels` does, and show how far that is, as a bar or in lines."""
    from tvist_server.kernels import KERNELS, compile_ahead

    said, shown = time.monotonic(), 0
    with progress(len(KERNELS), "kernels", "the next start continues") as advance:

        def show(done: int, total: int) -> None:
            nonlocal said, shown
            tell(done, total)
            advance(done - shown, None)
            if not err.is_terminal and done > shown and time.monotonic() - said >= SAY_EVERY:
                say(f"{done} of {total} kernels are compiled")
                said = time.monotonic()
            shown = done

        compile_ahead(processes, show)


def introduction(setups: Sequence["Setup"], profile: str | None) -> str:
    """Describe what listens: one robot with its settings, or the names of several."""
    first = setups[0]
    how = f"shaper {first.shaper}" + ("" if profile is None else f", profile {profile}")
    if len(setups) == 1:
        model = first.description.robot.model
        return f"{first.name} ({model}, {first.payload.mass:g} kg, {how}) listens"
    names = [setup.name for setup in setups]
    listed = ", ".join(names) if len(names) < 8 else f"{', '.join(names[:3])} … {names[-1]}"
    return f"a server of {len(names)} robots ({listed}; {how}) listens"


def say_who_can_reach(server: "Server | Workers", config: "ServeConfig", robots: int) -> None:
    """Say where UR's interfaces are open, and where anyone can move the robots."""
    for address, ports in server.ur:
        listed = ", ".join(f"{interface} {port}" for interface, port in ports.items())
        say(f"UR's interfaces are open on {address}: {listed}")
    if server.page is not None:
        say(f"figures for Prometheus are on {server.page}")
    whom = "this robot" if robots == 1 else "these robots"
    for endpoint in config.endpoints if config.insecure else ():
        say(f"anyone who can reach {endpoint} can move {whom}")


def say_recorded(recordings: "Sequence[Recording]") -> list[str]:
    """Say where each robot was recorded; return the errors that have ended recordings."""
    for recording in recordings:
        if recording.error is None:
            note = f", {recording.dropped} messages dropped" if recording.dropped else ""
            say(f"recorded into {recording.place}{note}")
    return [recording.error for recording in recordings if recording.error is not None]


def leave(server: "Server", code: int) -> None:
    """End the process with an exit code if the network would keep it; all that is ours is closed.

    Zenoh would wait for ten seconds, for a client that has stopped reading.
    """
    if not server.left:
        os._exit(code)
