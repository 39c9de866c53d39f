"""A search for cases in which a robot breaks its promises: `pytest -m search --cases 100 --seed 7`.

The cases of each test depend on the seed; the arms take turns.
"""

import inspect
from pathlib import Path

import pytest
from tests.search import paths, programs, sequences, stops, streams

from tvist_plant.description import load

SEVEN = str(Path(__file__).parents[1] / "plant" / "urdf" / "seven.urdf")
ARMS = ("ur3e", "ur5e", "ur16e", SEVEN, "ur30")
APART = 1_000_000  # difference between the case numbers of two consecutive seeds


def _arguments(test):
    return inspect.signature(test).parameters if inspect.isfunction(test) else ()


def pytest_generate_tests(metafunc):
    if "case" in metafunc.fixturenames:
        count, seed = metafunc.config.getoption("cases"), metafunc.config.getoption("seed")
        # Few cases of all tests include each arm, since each test that takes one starts with the next.
        of_arms = [test for test in vars(metafunc.module).values() if "arm" in _arguments(test)]
        first = of_arms.index(metafunc.function) if metafunc.function in of_arms else 0
        cases = [(ARMS[(first + number) % len(ARMS)], seed * APART + number) for number in range(count)]
        metafunc.parametrize("case", cases, ids=[f"{Path(arm).stem}-{number}" for arm, number in cases])


@pytest.fixture
def arm(case):
    return load(case[0])


@pytest.fixture
def number(case):
    return case[1]


@pytest.mark.search
def test_stop_of_a_move_stays_on_its_line_and_within_limits(arm, number):
    stops.judge(arm, stops.draw(arm, number))


@pytest.mark.search
def test_tool_follows_its_path_within_the_limits(number):
    paths.judge(number)


@pytest.mark.search
def test_stop_on_a_path_stays_on_it_and_rests_no_later(number):
    paths.judge_stop(number)


@pytest.mark.search
def test_slider_pauses_and_shaper_changes_keep_the_tool_on_its_path(number):
    paths.judge_changes(number)


@pytest.mark.nightly
def test_tool_follows_a_path_that_ends_slowly():
    paths.judge(581)


@pytest.mark.search
def test_stream_keeps_clearance_and_limits_however_it_ends(arm, number):
    streams.judge(arm, streams.draw(arm, number))


@pytest.mark.search
def test_random_commands_keep_limits_clearance_and_reproducibility(arm, number):
    sequences.Sequence(arm, number).run()


@pytest.mark.search
def test_random_programs_keep_all_promises(arm, number):
    programs.ProgramSequence(arm, number).run()
