"""The lesson that is served: a UR5e moves unshaped, and with two impulses for a frequency that may be wrong."""

from collections.abc import Awaitable, Callable
from dataclasses import dataclass
from typing import Annotated, Any

import msgspec
import numpy as np
from msgspec import Meta, Struct

from tvist_shaping import shaper
from tvist_view.signals import MOVING, moves
from tvist_view.stage import Tab, page
from tvist_view.track import Track

ZETA = 0.34
"""Damping ratio of the UR5e where it stops, for which its slider begins [-]."""


@dataclass(frozen=True)
class Compared:
    """One motion of the UR5e, unshaped and shaped."""

    unshaped: Track
    shaped: Track
    f_d: float
    """Frequency that the shaper was designed for [Hz]."""
    left: tuple[float, float]
    """Largest acceleration of the tool after the stop, unshaped and shaped [m/s²]."""


Run = Callable[[float, float], Awaitable[Compared]]
"""Makes the motion of the UR5e for an error of the frequency [-] and a damping ratio [-]."""

Share = Annotated[float, Meta(ge=-0.9, le=0.9)]


class Running(Struct, tag_field="do", tag="run", frozen=True):
    """Move the UR5e."""

    error: Share
    zeta: Annotated[float, Meta(ge=0.0, lt=1.0)]


_read = msgspec.json.Decoder(Running).decode


class Lesson:
    """The lesson's page: each tab has sliders of its own, so that a class can share one page.

    Args:
        run: Makes the UR5e's motion.
    """

    def __init__(self, run: Run) -> None:
        self._run = run
        self.page = page({"kind": "lesson", "ur5e_zeta": ZETA})

    async def meet(self, tab: Tab) -> None:
        """Answer a tab until it goes."""
        async for text in tab:
            try:
                wanted = _read(text)
            except msgspec.MsgspecError as error:
                await tab.send("notice", {"text": f"the page asked for what cannot be done: {error}"})
                continue
            await tab.send("run", _ran(await self._run(wanted.error, wanted.zeta), wanted.zeta))


def _ran(done: Compared, zeta: float) -> dict[str, Any]:
    unshaped, shaped = done.left
    start, moved = done.unshaped.start, moves(done.unshaped.signals)
    assert moved is not None  # it is a motion of ours
    return {
        "tracks": [track.packed(start) for track in (done.unshaped, done.shaped)],
        "begin": moved[0] - start - 0.05,
        "stop": moved[1] - start,
        "share": shaped / unshaped,
        "words": f"{_in_words(done.f_d, zeta)} They are right for {done.f_d:.2f} Hz. After the stop the tool "
        f"shook with {unshaped:.2f} m/s², shaped with {shaped:.2f}.",
    }


def largest_after_stop(track: Track) -> float:
    """Largest acceleration of the tool once the shaped reference has come to rest [m/s²]."""
    signals = track.signals
    moving = np.flatnonzero(signals.acceleration > MOVING)
    return float(np.nan_to_num(signals.alpha[moving[-1] + 5 :]).max(initial=0.0))


def _in_words(f_d: float, zeta: float) -> str:
    """The impulses of ZV for a mode, as a sentence."""
    impulses = shaper("zv").function(f_d, zeta)
    parts = [f"{100 * a:.0f} % after {1e3 * t:.0f} ms" for a, t in zip(impulses.A, impulses.tau, strict=True)]
    return f"Two impulses: {' and '.join(parts)}."
