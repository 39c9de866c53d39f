"""The demonstration's last words say what its figures say, whatever those are."""

import re
from types import SimpleNamespace

import pytest
from tests.docs.test_docs import check_command

from tvist_lab.studies.paper.answer import answer, checks, terms


def method(peak, still, delay=0.0):
    return {"peak_m_s2": peak, "still_after_ms": still, "delay_ms": delay}


def report(unshaped, shaped, **more):
    pair = {"unshaped": unshaped, "shaped": shaped}
    other = {"unshaped": method(0.5, 900.0), "shaped": method(0.25, 850.0, 70.0)}
    return {
        "table_1": {"Q1": {"f_d_hz": 6.9}, "Q2": {"f_d_hz": 6.9}, "Q3": {"f_d_hz": 15.2}},
        "baselines": {"Q1-Q2": other, "Q1-Q3": pair},
        "replayed_ticks": 1000,
        "missed_ticks": 0,
        "states_lost_on_the_way": 0,
        "recording_gives_same_figures": True,
        **more,
    }


def said(unshaped, shaped):
    return " ".join(answer(report(unshaped, shaped), "Q1-Q3"))


def test_the_answer_comes_first_and_is_short():
    lines = answer(report(method(0.6, 2600.0), method(0.03, 2500.0, 32.0)), "Q1-Q3")
    assert len(lines) == 4
    assert "0.60 m/s²" in lines[1]
    assert "0.030: 95 % less." in lines[1]
    assert lines[2] == "The shaped motion took 32 ms longer, and yet its tool came to rest 100 ms earlier."
    assert "Q1-Q2: 50 % less, came to rest 50 ms earlier" in lines[3]


def test_a_shaper_that_does_harm_is_said_to():
    words = said(method(0.5, 2500.0), method(0.75, 2520.0, 32.0))
    assert "50 % more" in words
    assert "took 32 ms longer, and its tool came to rest 20 ms later" in words


@pytest.mark.parametrize(
    ("before", "after", "words"),
    [
        (2500.0, None, "its tool was not at rest when the recording ended"),
        (None, 2500.0, "its tool came to rest, which the unshaped one did not"),
    ],
)
def test_a_tool_that_never_rests_is_said_not_to(before, after, words):
    assert words in said(method(0.5, before), method(0.5, after, 32.0))


def test_every_word_that_needs_it_is_explained():
    asked = report(method(0.6, 2600.0), method(0.03, 2500.0, 32.0))
    words = terms(asked, "Q1-Q3")
    assert words.keys() <= set(re.findall(r"\w+", " ".join(answer(asked, "Q1-Q3"))))
    assert "6.9 to 15.2 Hz" in words["shaped"]


@pytest.mark.parametrize(
    ("fact", "word"),
    [
        ({"missed_ticks": 3}, "late"),
        ({"states_lost_on_the_way": 3}, "lost"),
        ({"recording_gives_same_figures": False}, "different"),
    ],
)
def test_what_went_wrong_is_explained_only_if_it_did(fact, word):
    usual, other = (checks(report(method(0.6, 1.0), method(0.1, 1.0), **how), None) for how in ({}, fact))
    assert other.keys() - usual.keys() == {word}
    assert usual.keys() == {"repeatable"}


def test_a_replay_that_differs_is_said_to():
    words = checks(report(method(0.6, 1.0), method(0.1, 1.0)), "tick 7: actual_q")["repeatable"]
    assert "OTHER states: tick 7: actual_q" in words


@pytest.fixture
def told(tmp_path, monkeypatch, capsys):
    """What `tvist demo` prints of such a run."""
    from tvist_cli.commands import demo

    def tell(**options):
        found = report(method(0.6, 2600.0), method(0.03, 2500.0, 32.0))
        result = SimpleNamespace(report=found, difference=None, equal=True)
        monkeypatch.setattr("tvist_lab.studies.paper.served.serve", lambda *_: result)
        monkeypatch.setattr(demo, "_figures", lambda *_: tmp_path / "overview.png")
        demo.demo(output=tmp_path, **options)
        return capsys.readouterr().out

    return tell


def test_the_demonstration_ends_with_commands_that_exist(told):
    text = told()
    assert "Table" not in text
    *_, rest = text.partition("next:\n")
    commands = [re.split(r"\s{2,}", line.strip())[0].split() for line in rest.splitlines()]
    assert len(commands) == 4
    for program, *words in commands:
        assert program.endswith("tvist")
        check_command(["tvist", *words])


def test_programs_get_the_report_alone(told):
    assert told(json=True).startswith("{")
