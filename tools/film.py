"""`python -m tools.film`: make the film at the top of the README, in light and dark.

It shows the scene of `tvist view --compare none zv`, drawn frame by frame by a browser.
"""

import asyncio
import io
import shutil
import tempfile
from collections.abc import AsyncIterator, Sequence
from contextlib import asynccontextmanager, suppress
from pathlib import Path
from typing import Any

from PIL import Image
from websockets.exceptions import ConnectionClosed

from tvist_cli.output import progress
from tvist_cli.pages import MAGNIFY
from tvist_cli.tracks import compared
from tvist_view.signals import BRAKES_S
from tvist_view.stage import Tab, open_stage, page
from tvist_view.track import Track

IMAGES = Path(__file__).parents[1] / "docs" / "images"
SIZE = (1200, 760)  # width and height of the film [px]
RATE = 25  # frames per second
BROWSERS = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable", "chrome")
FLAGS = (
    "--headless=new",
    "--no-sandbox",  # containers have no user namespaces, and the page is trusted
    "--use-gl=angle",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--ignore-gpu-blocklist",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--no-first-run",
)
FIRST_S, NEXT_S = 120.0, 60.0  # time limits of the browser for the first frame and for each later one [s]
SLOW, SLOW_S = 5, 0.4
"""Factor of slow motion after a stop, and its duration [s]: the arm vibrates for a few tenths of a second."""
REST_S = 1.0  # time shown after a stop, unless the next motion starts earlier [s]
LEAD_S = 0.25  # the plot of a single motion starts this long before the stop [s]
HOLD_S = 2.0  # time for which the last frame stays [s]
QUALITY = 76  # quality of the frames, of 100
SHAPERS = ("none", "zv")
"""Shapers that the film compares."""


class FilmError(RuntimeError):
    """The film cannot be made."""


class Film:
    """Frames of runs with a common clock, and the result of their comparison, if there is one."""

    def __init__(
        self,
        tracks: Sequence[Track],
        factor: float,
        result: dict[str, Any] | None = None,
        theme: str = "light",
        size: tuple[int, int] = SIZE,
    ) -> None:
        self.start = min(track.start for track in tracks)
        self.end = max(track.end for track in tracks)
        self._stops = [track.stops for track in tracks]
        after = [
            track.signals.between(at + BRAKES_S, at + REST_S).largest_alpha()
            for track, stops in zip(tracks, self._stops, strict=True)
            for at in stops
        ]
        largest = max(track.signals.largest_alpha() for track in tracks)
        first = self._stops[0]
        self._boot = {
            "kind": "film",
            "width": size[0],
            "height": size[1],
            "theme": theme,
            "factor": factor,
            "tracks": [track.packed(self.start) for track in tracks],
            "most": 1.2 * max(*after, 0.1) if after else max(largest, 0.1),
            "rests": [(at - self.start, at - self.start + REST_S) for at in first],
            "begin": max(first[0] - self.start - LEAD_S, 0.0) if len(first) == 1 else 0.0,
            "result": result,
            "tells": first[0] - self.start + SLOW_S if first else 0.0,
        }

    def times(self) -> list[float]:
        """Return the simulation times of the frames, in slow motion after each stop [s]."""
        found = [self.start]
        while found[-1] < self.end:
            found.append(found[-1] + 1.0 / (RATE * (SLOW if self._slow(found[-1]) else 1)))
        return found[:-1] or found

    def _slow(self, time: float) -> bool:
        return any(at - BRAKES_S <= time < at + SLOW_S for at in self._stops[0])

    async def pictures(self, times: Sequence[float]) -> list[Image.Image]:
        """Draw the frames at simulation times [s]; raise FilmError if no browser draws them."""
        tabs: asyncio.Queue[Tab] = asyncio.Queue()
        drawn = asyncio.Event()

        async def meet(tab: Tab) -> None:
            tabs.put_nowait(tab)
            await drawn.wait()  # the connection ends when this returns

        async with open_stage(page(self._boot), meet, "127.0.0.1", 0) as url, _browser(url) as process:
            found: list[Image.Image] = []
            try:
                first, ended = asyncio.ensure_future(tabs.get()), asyncio.ensure_future(process.wait())
                await asyncio.wait({first, ended}, timeout=FIRST_S, return_when="FIRST_COMPLETED")
                ended.cancel()
                tab = await asyncio.wait_for(first, 0)
                told = aiter(tab)
                with progress(len(times), "pictures") as advance:
                    for time in times:
                        content = {"time": time - self.start, "slow": SLOW if self._slow(time) else 1}
                        await tab.send("draw", content)
                        picture = await asyncio.wait_for(anext(told), NEXT_S if found else FIRST_S)
                        assert isinstance(picture, bytes)  # the page sends only pictures
                        found.append(Image.open(io.BytesIO(picture)).convert("RGB"))
                        advance(1, None)
            except (TimeoutError, StopAsyncIteration, ConnectionClosed):
                raise FilmError("the browser does not draw: try it with another Chromium") from None
            finally:
                drawn.set()
            return found


def browser() -> str | None:
    """Return the path of a browser that can draw films; None if there is none."""
    return next(filter(None, map(shutil.which, BROWSERS)), None)


@asynccontextmanager
async def _browser(url: str) -> AsyncIterator[asyncio.subprocess.Process]:
    program = browser()
    if program is None:
        raise FilmError("films are drawn by Chromium, and there is none: apt-get install chromium")
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as profile:
        process = await asyncio.create_subprocess_exec(
            program, *FLAGS, f"--user-data-dir={profile}", url,
            stdout=asyncio.subprocess.DEVNULL, stderr=asyncio.subprocess.DEVNULL,
        )  # fmt: skip
        try:
            yield process
        finally:
            with suppress(ProcessLookupError):
                process.kill()
            await process.wait()


def main() -> None:
    """Simulate both arms, and write the film as animated WebP."""
    shows = compared(SHAPERS, "ur5e")
    for theme in ("light", "dark"):
        film = Film(shows.tracks, MAGNIFY, shows.result, theme)
        first, *later = asyncio.run(film.pictures(film.times()))
        durations = [round(1000 / RATE)] * len(later) + [round(1000 * HOLD_S)]
        first.save(
            IMAGES / f"without-and-with-{theme}.webp", save_all=True, append_images=later, duration=durations,
            loop=0, quality=QUALITY, method=4, minimize_size=True,
        )  # fmt: skip


if __name__ == "__main__":
    main()
