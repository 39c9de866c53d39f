"""The page of recorded runs: one robot, or several beside each other at the same tick."""

import asyncio
from collections.abc import Sequence
from typing import Any

from tvist_view.request_handler import Verdict
from tvist_view.stage import Tab, page
from tvist_view.track import Track


def playback(
    tracks: Sequence[Track], title: str, *, factor: float = 1.0, result: dict[str, Any] | None = None
) -> str:
    """Return a page, which needs no server, that plays runs with a common clock.

    `factor` is the initial magnification of the bending; `result` is the verdict on two runs, from `said`.
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
    """Return a verdict in the form in which the page shows it."""
    return {**verdict, "with": shaper, "motion": motion}


async def meet(tab: Tab) -> None:
    """Wait until a tab closes; the page already contains all its data."""
    async for _ in tab:
        await asyncio.sleep(0)
