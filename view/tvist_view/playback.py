"""The page of recorded runs: one robot, or several beside each other at the same tick."""

import asyncio
from collections.abc import Sequence
from typing import Any

from tvist_view.beside import Verdict
from tvist_view.stage import Tab, page
from tvist_view.track import Track


def playback(
    tracks: Sequence[Track], title: str, *, factor: float = 1.0, result: dict[str, Any] | None = None
) -> str:
    """A page that plays runs back; it needs no server.

    Args:
        tracks: The runs; their times are those of one clock.
        title: What the page is called.
        factor: Magnification of the bending to begin with.
        result: What the comparison of two runs says, as `said` makes it; None: nothing.
    """
    start = min(track.start for track in tracks)
    return page(
        {
            "kind": "playback",
            "title": title,
            "factor": factor,
            "tracks": [track.packed(start) for track in tracks],
            "result": result,
        }
    )


def said(verdict: Verdict, shaper: str, motion: str) -> dict[str, Any]:
    """A verdict as the page writes it in large figures."""
    return {**verdict, "with": shaper, "motion": motion}


async def meet(tab: Tab) -> None:
    """Wait until a tab goes that has all it needs."""
    async for _ in tab:
        await asyncio.sleep(0)
