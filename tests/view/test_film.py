"""Films: the times of their frames, and that a browser draws them."""

import numpy as np
import pytest
from tools.film import Film, FilmError

from .browser import CHROMIUM


def test_film_is_slow_after_each_stop(tracks):
    film = Film(tracks, 100.0)
    steps = np.diff(film.times())
    assert sorted(set(steps.round(6))) == [0.008, 0.04]


async def test_browser_draws_different_frames(tracks):
    if CHROMIUM is None:
        pytest.skip("there is no Chromium")
    film = Film(tracks, 100.0, size=(300, 200))
    first, later = await film.pictures([film.start, film.start + 1.2])
    assert first.size == later.size == (300, 200)
    assert (np.asarray(first) != np.asarray(later)).any()
    assert len(np.unique(np.asarray(first).reshape(-1, 3), axis=0)) > 50


async def test_missing_browser_is_reported_with_what_to_install(tracks, monkeypatch):
    monkeypatch.setattr("tools.film.BROWSERS", ("no-such-browser",))
    film = Film(tracks, 100.0)
    with pytest.raises(FilmError, match="apt-get install chromium"):
        await film.pictures([film.start])
