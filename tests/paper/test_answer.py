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


def test_answer_is_short_and_its_terms_are_explained():
    asked = report(method(0.6, 2600.0), method(0.03, 2500.0, 32.0))
    lines = answer(asked, "Q1-Q3")
    assert len(lines) == 4
    assert "0.60 m/s²" in lines[1]
    assert "0.030: 95 % less." in lines[1]
    assert lines[2] == "The shaped motion took 32 ms longer, and yet its tool came to rest 100 ms earlier."
    assert "Q1-Q2: 50 % less, came to rest 50 ms earlier" in lines[3]
    words = terms(asked, "Q1-Q3")
    assert words.keys() <= set(re.findall(r"\w+", " ".join(lines)))
    assert "6.9 to 15.2 Hz" in words["shaped"]


@pytest.mark.parametrize(
    ("after", "words"),
    [
        ((0.75, 2520.0, 32.0), "50 % more; took 32 ms longer, and its tool came to rest 20 ms later"),
        ((0.5, None, 32.0), "its tool was not at rest when the recording ended"),
    ],
)
def test_more_vibration_and_a_tool_that_never_rests_are_reported(after, words):
    said = " ".join(answer(report(method(0.5, 2500.0), method(*after)), "Q1-Q3"))
    assert all(part in said for part in words.split("; "))


@pytest.mark.parametrize(
    ("fact", "word"),
    [
        ({"missed_ticks": 3}, "late"),
        ({"states_lost_on_the_way": 3}, "lost"),
        ({"recording_gives_same_figures": False}, "different"),
    ],
)
def test_only_actual_problems_are_explained(fact, word):
    pair = method(0.6, 1.0), method(0.1, 1.0)
    usual, other = (checks(report(*pair, **how), None) for how in ({}, fact))
    assert other.keys() - usual.keys() == {word}
    assert usual.keys() == {"repeatable"}
    assert "OTHER states: tick 7: actual_q" in checks(report(*pair), "tick 7: actual_q")["repeatable"]


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


def test_demonstration_ends_with_existing_commands(told):
    text = told()
    assert "Table" not in text
    *_, rest = text.partition("next:\n")
    commands = [re.split(r"\s{2,}", line.strip())[0].split() for line in rest.splitlines()]
    assert len(commands) == 4
    for program, *words in commands:
        assert program.endswith("tvist")
        check_command(["tvist", *words])


def test_json_contains_the_report_alone(told):
    assert told(json=True).startswith("{")
