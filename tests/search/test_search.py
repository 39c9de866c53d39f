"""A search for cases in which a robot breaks its promises: `pytest -m search --cases 100 --seed 7`.

Each test tries as many cases as asked for, which differ for every seed, and the arms take turns.
"""

from functools import lru_cache
from pathlib import Path

import pytest
from tests.search import paths, programs, sequences, stops, streams

from tvist_plant.description import load

SEVEN = str(Path(__file__).parents[1] / "plant" / "urdf" / "seven.urdf")
ARMS = ("ur3e", "ur5e", "ur16e", "ur30", SEVEN)
APART = 1_000_000
"""Difference between the case numbers of two consecutive seeds."""


@lru_cache
def loaded(name):
    return load(name)


def pytest_generate_tests(metafunc):
    if "case" in metafunc.fixturenames:
        count, seed = metafunc.config.getoption("cases"), metafunc.config.getoption("seed")
        first = len(metafunc.function.__name__)  # so that few cases of all tests meet every arm between them
        cases = [(ARMS[(first + number) % len(ARMS)], seed * APART + number) for number in range(count)]
        metafunc.parametrize("case", cases, ids=[f"{Path(arm).stem}-{number}" for arm, number in cases])


@pytest.fixture
def arm(case):
    return loaded(case[0])


@pytest.fixture
def number(case):
    return case[1]


@pytest.mark.search
def test_a_stop_stays_on_the_way_behind_the_motion_keeps_the_limits_and_is_told(arm, number):
    stops.judge(arm, stops.draw(arm, number))


@pytest.mark.search
def test_a_path_of_the_tool_is_where_it_should_be(number):
    paths.judge(number)


@pytest.mark.search
def test_a_stop_of_a_path_stays_on_it_behind_the_motion_and_rests_no_later(number):
    paths.judge_stop(number)


@pytest.mark.search
def test_slider_pauses_and_other_shapers_stay_on_a_path_and_lead_to_its_end(number):
    paths.judge_changes(number)


def test_a_path_that_creeps_to_its_end_is_where_it_should_be():
    paths.judge(581)


@pytest.mark.search
def test_a_stream_keeps_the_clearance_and_the_limits_however_it_ends(arm, number):
    streams.judge(arm, streams.draw(arm, number))


@pytest.mark.search
def test_whatever_is_sent_the_promises_hold(arm, number):
    sequences.Sequence(arm, number).run()


@pytest.mark.search
def test_whatever_programs_do_the_promises_hold(arm, number):
    programs.ProgramSequence(arm, number).run()
