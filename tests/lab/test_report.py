"""A report answers its question in a sentence, from what the files show and not from what they are called."""

import re
from dataclasses import replace

import html5lib
import pytest
from tests.lab.made_logs import SyntheticLog

from tvist_cli.output import write_report
from tvist_lab.metrics import MotionResult
from tvist_lab.report import ReportPage, of_recordings, recordings_page, render
from tvist_lab.report.verdict import shaping_of, verdict_on_one

LOUD, QUIET = ((9.0, 0.12, 1.0),), ((9.0, 0.12, 0.2),)


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


def test_verdict_reports_less_vibration_by_shaping(tmp_path):
    before = log(tmp_path, "b.csv", LOUD, shaped_by=0.0)
    after = log(tmp_path, "a.csv", QUIET, shaped_by=0.05, seed=2)
    verdict = recordings_verdict([before, after])
    assert re.match(r"a.csv vibrates (7\d|8\d) % less after its stops than b.csv", verdict[0])
    assert "b.csv was not shaped: its target ends together with its reference." in verdict
    assert re.fullmatch(r"a.csv was shaped: its target ends (4[6-9]|50) ms after its reference.", verdict[2])


def test_unshaped_run_gives_shaping_no_credit(tmp_path):
    loud = log(tmp_path, "unshaped.csv", LOUD, shaped_by=0.0)
    other = log(tmp_path, "shaped.csv", LOUD, shaped_by=0.0, seed=2)
    verdict = recordings_verdict([loud, other])
    assert verdict[0].startswith("shaped.csv vibrates as much as unshaped.csv after its stops")
    assert "shaped.csv was not shaped: its target ends together with its reference." in verdict
    assert "vibrates noticeably after 1 of 1 stop" in recordings_verdict([other])[0]
    quiet = log(tmp_path, "b.csv", QUIET, shaped_by=0.0, seed=2)
    assert "So shaping is not the reason why b.csv vibrates less." in recordings_verdict([loud, quiet])


def test_verdict_reports_more_vibration_none_and_no_common_motion(tmp_path):
    quiet, loud = log(tmp_path, "quiet.csv", QUIET), log(tmp_path, "loud.csv", LOUD, seed=2)
    assert re.match(r"loud.csv vibrates \d+ % more", recordings_verdict([quiet, loud])[0])
    still = [log(tmp_path, f"{n}.csv", ((9.0, 0.1, 0.02),), seed=n) for n in (3, 4)]
    assert recordings_verdict(still)[0].startswith("Neither 3.csv nor 4.csv vibrates noticeably")
    other = SyntheticLog(joints=7, motions=1).csv(tmp_path / "other.csv")
    nothing = "quiet.csv and other.csv have no motion in common, so nothing is compared."
    assert recordings_verdict([quiet, other])[0] == nothing


def test_unmeasured_values_do_not_affect_the_verdict():
    unknown = MotionResult(start_s=0.0, stop_s=1.0)
    assert shaping_of([unknown], "x").shaped is None
    assert "no vibration could be measured" in verdict_on_one([unknown], "x")[0]
    assert verdict_on_one([], "x") == ["x contains no motion."]
    assert shaping_of([replace(unknown, delay_ms=38.0)], "x").shaped is True
    mixed = [replace(unknown, delay_ms=delay) for delay in (0.0, 30.0, 40.0)]
    assert shaping_of(mixed, "x").sentence.startswith(
        "2 of 3 motions of x were shaped: their targets end 30 ms to 40 ms"
    )


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    """Names of markup: of a log without accelerometer, and, also like a formula, of one that is drawn."""
    folder = tmp_path_factory.mktemp("report")
    mute = SyntheticLog(motions=1).without("actual_tool_accelerometer")
    drawn = SyntheticLog(motions=1).csv(folder / r"<script>&100% $\frac{$.csv")
    return [mute.csv(folder / "<script>alert(1)<&.csv"), drawn]


@pytest.fixture(scope="module")
def page(files):
    return render(recordings_page(files, "tvist log report"))


def test_page_is_valid_small_and_self_contained(page):
    html5lib.HTMLParser(strict=True).parse(page)
    assert len(page.encode()) < 5e6
    for address in re.findall(r'(?:src|href)="([^"]*)"', page):
        assert address.startswith(("data:", "#word-"))
    assert set(re.findall(r'href="#([^"]*)"', page)) <= set(re.findall(r'id="([^"]*)"', page))
    assert "t<sub>stb</sub>" in page
    assert "prefers-color-scheme: dark" in page
    assert not re.search(r"https?://|@import|url\(|<script", page)
    assert page.count("<img") == page.count('alt="') > 1
    assert r"100% $\frac{$.csv" in page


def test_same_files_give_the_same_page(files, page):
    assert render(recordings_page(files, "tvist log report")) == page


def test_page_is_written_for_a_file_name_that_is_no_text(tmp_path):
    write_report(tmp_path / "r.html", ReportPage("bad\udcff.mcap", ["It shook."], []))
    assert "bad?.mcap" in (tmp_path / "r.html").read_text(encoding="utf-8")
