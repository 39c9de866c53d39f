"""A report answers its question in a sentence, from what the files show and not from what they are called."""

import re
from dataclasses import replace
from pathlib import Path

import html5lib
import pytest
from tests.lab.synthetic_logs import SyntheticLog

from tvist_cli.output import write_report
from tvist_lab.metrics import MotionResult
from tvist_lab.recordings import RecordingError
from tvist_lab.report import Page, of_recordings, recordings_page, render
from tvist_lab.report.verdict import shaping_of, verdict_on_one

LOUD, QUIET = ((9.0, 0.12, 1.0),), ((9.0, 0.12, 0.2),)
JOURNAL = Path(__file__).parents[1] / "journals/moves_with_every_shaper.mcap"


def log(tmp_path, name, modes, *, shaped_by=None, seed=1, motions=1):
    """A log of this controller's RTDE: `target_q` before shaping and `shaped_q` after it."""
    made = SyntheticLog(modes=modes, seed=seed, motions=motions)
    if shaped_by is not None:
        ticks = round(shaped_by / 0.002)
        made.columns["shaped_q"] = made.columns["target_q"].copy()
        early = made.columns["target_q"]
        early[: -ticks or None] = early[ticks:].copy()
        if ticks:
            early[-ticks:] = early[-ticks - 1]
    return made.csv(tmp_path / name)


def recordings_verdict(paths):
    """The sentences of the report's verdict, without its tables and figures."""
    base, *others = of_recordings._files(paths)
    compared = [(other, of_recordings.compare(base.measured, other.measured)) for other in others]
    return of_recordings._verdict(base, compared)


def test_less_vibration_is_said_with_its_figures_and_that_it_was_shaped(tmp_path):
    verdict = recordings_verdict(
        [
            log(tmp_path, "before.csv", LOUD, shaped_by=0.0),
            log(tmp_path, "after.csv", QUIET, shaped_by=0.05, seed=2),
        ]
    )
    assert re.match(r"after.csv vibrates (7\d|8\d) % less after its stops than before.csv", verdict[0])
    assert "before.csv was not shaped: its target ends together with its reference." in verdict
    assert re.fullmatch(
        r"after.csv was shaped: its target ends (4[6-9]|50) ms after its reference.", verdict[2]
    )


def test_an_unshaped_run_that_is_called_shaped_is_found_out(tmp_path):
    files = [
        log(tmp_path, "unshaped.csv", LOUD, shaped_by=0.0),
        log(tmp_path, "shaped.csv", LOUD, shaped_by=0.0, seed=2),
    ]
    verdict = recordings_verdict(files)
    assert verdict[0].startswith("shaped.csv vibrates as much as unshaped.csv after its stops")
    assert "shaped.csv was not shaped: its target ends together with its reference." in verdict
    alone = recordings_verdict(files[1:])
    assert "vibrates noticeably after 1 of 1 stop" in alone[0]
    assert "shaped.csv was not shaped: its target ends together with its reference." in alone


def test_shaping_is_not_given_the_credit_where_there_was_none(tmp_path):
    files = [
        log(tmp_path, "a.csv", LOUD, shaped_by=0.0),
        log(tmp_path, "b.csv", QUIET, shaped_by=0.0, seed=2),
    ]
    assert "So shaping is not the reason why b.csv vibrates less." in recordings_verdict(files)


def test_more_vibration_and_none_at_all_are_said(tmp_path):
    quiet, loud = log(tmp_path, "quiet.csv", QUIET), log(tmp_path, "loud.csv", LOUD, seed=2)
    assert re.match(r"loud.csv vibrates \d+ % more", recordings_verdict([quiet, loud])[0])
    still = [log(tmp_path, f"{n}.csv", ((9.0, 0.1, 0.02),), seed=n) for n in (3, 4)]
    assert recordings_verdict(still)[0].startswith("Neither 3.csv nor 4.csv vibrates noticeably")


def test_files_without_a_common_motion_are_not_compared(tmp_path):
    other = SyntheticLog(joints=7).csv(tmp_path / "other.csv")
    verdict = recordings_verdict([log(tmp_path, "a.csv", LOUD), other])
    assert verdict[0] == "a.csv and other.csv have no motion in common, so nothing is compared."


def test_what_was_not_measured_decides_nothing():
    unknown = MotionResult(start_s=0.0, stop_s=1.0)
    assert shaping_of([unknown], "x").shaped is None
    assert "no vibration could be measured" in verdict_on_one([unknown], "x")[0]
    assert verdict_on_one([], "x") == ["x contains no motion."]
    assert shaping_of([replace(unknown, delay_ms=38.0)], "x").shaped is True
    mixed = [replace(unknown, delay_ms=delay) for delay in (0.0, 30.0, 40.0)]
    assert shaping_of(mixed, "x").sentence.startswith(
        "2 of 3 motions of x were shaped: their targets end 30 ms to 40 ms"
    )


def test_a_name_that_reads_like_a_formula_is_written_as_it_is(tmp_path):
    named = [SyntheticLog(motions=1).csv(tmp_path / name) for name in (r"_$\frac{$.csv", "100% & $x_.csv")]
    text = render(recordings_page(named, "tvist log report"))
    assert r"_$\frac{$.csv" in text
    assert "100% &amp; $x_.csv" in text


@pytest.fixture(scope="module")
def page(tmp_path_factory):
    folder = tmp_path_factory.mktemp("report")
    hostile = SyntheticLog(motions=1).csv(folder / "<script>alert(1)</script>&.csv".replace("/", "_"))
    return render(recordings_page([hostile, JOURNAL], "tvist log report"))


def test_the_page_is_valid_and_small_and_loads_nothing(page):
    html5lib.HTMLParser(strict=True).parse(page)
    assert len(page.encode()) < 5e6
    for address in re.findall(r'(?:src|href)="([^"]*)"', page):
        assert address.startswith(("data:", "#word-"))
    assert set(re.findall(r'href="#([^"]*)"', page)) <= set(re.findall(r'id="([^"]*)"', page))
    assert "t<sub>stb</sub>" in page
    assert "prefers-color-scheme: dark" in page
    assert not re.search(r"https?://|@import|url\(|<script", page)
    assert page.count("<img") == page.count('alt="') > 1


@pytest.mark.parametrize("width", [1100, 390])
def test_no_table_of_the_page_is_wider_than_the_window(page, tmp_path, width):
    from tests.view.browser import browser

    (tmp_path / "page.html").write_text(page, encoding="utf-8")
    with browser() as chromium:
        shown = chromium.new_page(viewport={"width": width, "height": 800})
        shown.goto((tmp_path / "page.html").as_uri())
        cells = "[...document.querySelectorAll('table, td, h1, p, img')].map(one => one.getBoundingClientRect().right)"
        assert max(shown.evaluate(cells)) <= width
        assert shown.evaluate("document.documentElement.scrollWidth") <= width
        text = shown.evaluate("Math.max(...[...document.querySelectorAll('p')].map(one => one.offsetWidth))")
        assert text < 800


def test_the_same_files_give_the_same_page(page, tmp_path):
    again = SyntheticLog(motions=1).csv(tmp_path / "<script>alert(1)</script>&.csv".replace("/", "_"))
    other = render(recordings_page([again, JOURNAL], "tvist log report"))
    assert re.sub(r"<dt>File</dt>\n<dd>.*", "", other) == re.sub(r"<dt>File</dt>\n<dd>.*", "", page)


def test_a_file_that_is_no_recording_is_refused(tmp_path):
    (tmp_path / "notes.txt").write_text("nothing\n")
    with pytest.raises(RecordingError, match=r"notes.txt"):
        recordings_page([tmp_path / "notes.txt"], "")


def test_a_page_is_written_although_a_file_has_a_name_that_is_no_text(tmp_path):
    write_report(tmp_path / "r.html", Page("bad\udcff.mcap", ["It shook."], []))
    assert "bad?.mcap" in (tmp_path / "r.html").read_text(encoding="utf-8")
