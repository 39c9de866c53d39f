"""The lesson: one mass on a spring and two impulses, then the same on the UR5e."""

from collections.abc import Awaitable, Callable
from dataclasses import dataclass
from typing import Annotated, Any

import msgspec
import numpy as np
from msgspec import Meta, Struct

from tvist_view.look import Floats, Look
from tvist_view.oscillator import TURN, impulses_in_words, leftover, leftovers, swing
from tvist_view.signals import MOVING, moves
from tvist_view.stage import Tab, page
from tvist_view.track import Track

ERRORS = np.linspace(-0.5, 0.5, 101)
"""Errors of the believed frequency over which the curve of what is left is drawn [-]."""
EVERY = 4
"""Samples of the swing of which the page gets one."""
ZETA = 0.34
"""Damping ratio of the UR5e where it stops, for which its slider begins [-]."""


@dataclass(frozen=True)
class OneMass:
    """The arm with one flexible joint."""

    look: Look
    f_d_range: tuple[float, float]
    """Frequencies that its elbow can give it [Hz]."""
    elbow: Callable[[float], float]
    """Angle of the elbow [rad] for a frequency [Hz]."""


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


class Swinging(Struct, tag_field="do", tag="swing", frozen=True):
    """Let the one mass swing."""

    f_d: Annotated[float, Meta(gt=0.0, le=100.0)]
    zeta: Annotated[float, Meta(ge=0.0, lt=1.0)]
    error: Share


class Running(Struct, tag_field="do", tag="run", frozen=True):
    """Move the UR5e."""

    error: Share
    zeta: Annotated[float, Meta(ge=0.0, lt=1.0)]


_read = msgspec.json.Decoder(Swinging | Running).decode


class Lesson:
    """The lesson's page: each tab has sliders of its own, so that a class can share one page.

    Args:
        one_mass: The arm with one flexible joint.
        run: Makes the UR5e's motion.
    """

    def __init__(self, one_mass: OneMass, run: Run) -> None:
        self._one, self._run = one_mass, run
        low, high = one_mass.f_d_range
        self.page = page(
            {
                "kind": "lesson",
                "look": one_mass.look.packed(),
                "range": [round(low, 2), round(high, 2)],
                "turn": TURN,
                "ur5e_zeta": ZETA,
            }
        )

    async def meet(self, tab: Tab) -> None:
        """Answer a tab until it goes."""
        async for text in tab:
            try:
                wanted = _read(text)
            except msgspec.MsgspecError as error:
                await tab.send("notice", {"text": f"the page asked for what cannot be done: {error}"})
                continue
            if isinstance(wanted, Swinging):
                await tab.send("swing", self._swing(wanted))
            else:
                await tab.send("run", _ran(await self._run(wanted.error, wanted.zeta), wanted.zeta))

    def _swing(self, wanted: Swinging) -> dict[str, Any]:
        f_d, zeta = wanted.f_d, wanted.zeta
        believed = (f_d * (1.0 + wanted.error), zeta)
        both = swing(f_d, zeta, None), swing(f_d, zeta, believed)
        share = leftover(f_d, zeta, believed)
        return {
            "time": _short(both[0].time),
            "reference": [_short(one.reference) for one in both],
            "elbow": self._one.elbow(f_d),
            "deflections": [_short(one.deflection) for one in both],
            "share": share,
            "words": f"{impulses_in_words(*believed)} They are right for {believed[0]:.2f} Hz; the arm swings with "
            f"{f_d:.2f} Hz: {1e3 * both[1].left:.1f} of {1e3 * both[0].left:.1f} mrad are left.",
            "errors": ERRORS.tolist(),
            "left": leftovers(f_d, zeta, ERRORS).tolist(),
            "error": wanted.error,
        }


def _short(values: Floats) -> list[float]:
    return [round(value, 5) for value in values[::EVERY].tolist()]


def _ran(done: Compared, zeta: float) -> dict[str, Any]:
    unshaped, shaped = done.left
    start, moved = done.unshaped.start, moves(done.unshaped.signals)
    assert moved is not None  # it is a motion of ours
    return {
        "tracks": [track.packed(start) for track in (done.unshaped, done.shaped)],
        "begin": moved[0] - start - 0.05,
        "stop": moved[1] - start,
        "share": shaped / unshaped,
        "words": f"{impulses_in_words(done.f_d, zeta)} They are right for {done.f_d:.2f} Hz. After the stop the tool "
        f"shook with {unshaped:.2f} m/s², shaped with {shaped:.2f}.",
    }


def largest_after_stop(track: Track) -> float:
    """Largest acceleration of the tool once the shaped reference has come to rest [m/s²]."""
    signals = track.signals
    moving = np.flatnonzero(signals.acceleration > MOVING)
    return float(np.nan_to_num(signals.alpha[moving[-1] + 5 :]).max(initial=0.0))


def frequency_to_elbow(f_d: Callable[[float], float], low: float, high: float) -> Callable[[float], float]:
    """The inverse of a frequency that rises with the elbow's angle, by interpolation.

    Args:
        f_d: Frequency at an angle [Hz].
        low: Smallest angle [rad].
        high: Largest angle [rad].
    """
    angles: Floats = np.linspace(low, high, 400)
    frequencies = [f_d(float(angle)) for angle in angles]
    return lambda wanted: float(np.interp(wanted, frequencies, angles))
