"""Recorded and compared runs: on the page, as a film and as a page of its own."""

import asyncio
from pathlib import Path

import numpy as np
import pytest
from PIL import Image, ImageSequence
from tests.conformance.served import finished, free_endpoint

from tvist_lab.compared import run_beside
from tvist_plant.description import load
from tvist_view.deflection import Magnification
from tvist_view.film import Film
from tvist_view.playback import Playback
from tvist_view.stage import StageError, open_stage
from tvist_view.track import Shown, Track, TrackError

POSES = load("ur5e").poses
OLD = Path(__file__).parents[1] / "journals" / "live_lost_lease.mcap"


def run(*arguments):
    return finished("-m", "tvist_cli", "view", *arguments)


@pytest.fixture(scope="module")
def tracks():
    """Q1 to Q2, unshaped and shaped."""
    found = []
    for shaper in ("none", "zv"):
        info, collected = asyncio.run(run_beside(shaper, (POSES["Q1"], POSES["Q2"])))
        found.append(Track(Shown(shaper, info.geometry, info.payload), collected.states, collected.truths))
    return found


@pytest.fixture
def stage():
    server = open_stage("127.0.0.1", 0, "test")
    yield server
    server.stop()


def test_compared_runs_are_at_the_same_tick_and_begin_each_motion_together(tracks):
    none, zv = tracks
    assert (none.start, none.end) == (zv.start, zv.end)
    starts = [np.flatnonzero(track.signals.unshaped > 0.1)[0] for track in tracks]
    assert starts[0] == starts[1]
    assert none.at(1.0).state.tick == zv.at(1.0).state.tick == 500


def test_every_time_has_a_moment(tracks):
    track = tracks[0]
    assert track.at(-1.0).state.timestamp == track.start
    assert track.at(1e3).state.timestamp == track.end
    assert track.at(1.0).truth.tick == track.at(1.0).state.tick


def test_nothing_to_show_is_said(tracks):
    with pytest.raises(TrackError, match="no state"):
        Track(tracks[0].shown, [], [])


async def test_the_page_shows_every_moment_and_plays_on(stage, tracks):
    page = Playback(stage, tracks, factor=100.0)
    for time in (0.0, 1.0, 2.0, page.end - page.start):
        page.show(time)
    playing = asyncio.create_task(page.run())
    while float(page._time.value) < 0.1:  # noqa: ASYNC110
        await asyncio.sleep(0)
    playing.cancel()


def test_the_page_of_its_own_holds_the_run_and_asks_nothing_of_the_network(stage, tracks):
    page = Playback(stage, tracks).html()
    assert "__VISER_EMBED_DATA__" in page
    assert len(page) > 200_000
    assert 'src="http' not in page


def test_the_film_is_slow_where_the_arm_rings_and_its_pictures_differ(tracks, tmp_path):
    film = Film(tracks, Magnification(100.0))
    steps = np.diff(film.times())
    assert sorted(set(steps.round(6))) == [0.008, 0.04]
    first, later = (np.asarray(film.picture(time)) for time in (film.start, 1.2))
    assert first.shape == later.shape
    assert (first != later).any()


@pytest.mark.nightly
def test_a_film_and_a_page_are_written_by_a_command(tmp_path):
    gif, html = tmp_path / "x.gif", tmp_path / "x.html"
    ended = run("--compare", "none", "zv", "--gif", gif, "--html", html)
    assert (ended.returncode, ended.stdout) == (0, ""), ended.stderr
    with Image.open(gif) as film:
        assert sum(1 for _ in ImageSequence.Iterator(film)) > 50
    assert html.stat().st_size > 200_000


@pytest.mark.parametrize(
    ("arguments", "code", "says"),
    [
        (("--compare", "none"), 2, "compare has 1 shapers: give two or three"),
        (("--compare", "none", "--compare", "nope"), 2, "nope"),
        (("--magnify", "0.5"), 2, "magnify is 0.5: must be 1 to 300"),
        (("--magnify", "nan"), 2, "magnify"),
        (("missing.mcap",), 1, "missing.mcap"),
        (("--gif", "x.gif"), 2, "need a recording or --compare"),
        (("--address", "0.0.0.0"), 1, "--insecure"),  # noqa: S104
        (("--port", "70000"), 1, "port 70000"),
    ],
)
def test_misuse_is_a_sentence(arguments, code, says):
    ended = run(*arguments)
    assert ended.returncode == code, ended.stderr
    assert says in ended.stderr
    assert ended.stderr.startswith("tvist: ")
    assert ended.stderr.count("\n") == 1


def test_a_port_in_use_is_said():
    host, port = free_endpoint().rpartition("/")[2].split(":")
    first = open_stage(host, int(port), "first")
    try:
        with pytest.raises(StageError, match="Another port: --port"):
            open_stage(host, int(port), "second")
    finally:
        first.stop()


def test_a_recording_of_an_older_server_is_drawn_by_the_robot_file_in_it(tmp_path):
    ended = run(OLD, "--gif", tmp_path / "x.gif")
    assert ended.returncode == 0, ended.stderr
    assert (tmp_path / "x.gif").exists()
