"""Recorded and compared runs: on the page, and as a page of its own."""

from pathlib import Path

import numpy as np
import pytest
from tests.conformance.served import PATIENCE, finished

from tvist_view.playback import playback, said
from tvist_view.track import Track, TrackError

OLD = Path(__file__).parents[1] / "journals" / "live_lost_lease.mcap"


def test_compared_runs_start_together(tracks):
    none, zv = tracks
    assert (none.start, none.end) == (zv.start, zv.end)
    starts = [np.flatnonzero(track.signals.unshaped > 0.1)[0] for track in tracks]
    assert starts[0] == starts[1]


def test_empty_run_is_refused(tracks):
    with pytest.raises(TrackError, match="no state"):
        Track("x", tracks[0].look, [], [])


def test_stops_of_a_run_are_where_its_reference_rests(tracks):
    for track in tracks:
        (stop,) = track.stops  # a cruise is no stop
        q = np.array([state.reference_q for state in track._states])
        assert np.ptp(q[track.signals.time > stop + 0.01], axis=0).max() < 1e-6


@pytest.mark.nightly
def test_command_writes_a_page(tmp_path):
    html = tmp_path / "x.html"
    ended = finished("-m", "tvist_cli", "view", "--compare", "none", "zv", "--html", html)
    assert (ended.returncode, ended.stdout) == (0, ""), ended.stderr
    assert html.stat().st_size > 200_000


def test_recording_of_an_older_server_is_drawn_by_its_robot_file(tmp_path):
    ended = finished("-m", "tvist_cli", "view", OLD, "--html", tmp_path / "x.html")
    assert ended.returncode == 0, ended.stderr
    assert "drawn stiff" in (tmp_path / "x.html").read_text()


def test_page_in_a_file_plays_and_seeks_without_network(chromium, tracks, tmp_path):
    file = tmp_path / "page.html"
    result = said({"less_percent": 94.0, "earlier_ms": 134.0, "before": 0.61, "after": 0.04}, "zv", "Q1 → Q2")
    file.write_text(playback(tracks, "both", factor=100.0, result=result), encoding="utf-8")
    page = chromium.new_page(viewport={"width": 260, "height": 320})
    page.set_default_timeout(PATIENCE * 1000.0)
    asked = []
    page.on("request", lambda request: asked.append(request.url))
    page.goto(file.as_uri())
    page.wait_for_function("tvist.time > 0.1")
    page.get_by_role("button", name="pause").dispatch_event("click")
    page.evaluate("tvist.seek(1.0)")
    page.wait_for_function("tvist.shown === 1")
    for words in ("94 % less vibration", "at rest 134 ms earlier", "1.00 s of", "without", "with zv"):
        assert page.get_by_text(words).first.is_visible()
    assert page.evaluate("tvist.tracks.map((track) => track.label)") == [track.label for track in tracks]
    page.close()
    assert all(url.startswith(("file:", "data:", "blob:")) for url in asked), asked
