"""Every runner gives each task its result or its failure, whatever happens to the others."""

import itertools
import threading
from pathlib import Path

import pytest
from tests.lab.runner_work import OddError, die, die_once, function_of, square, square_or_raise

from tvist_controller.calibrations import load as load_calibration
from tvist_lab.runners import Failed, Processes, TaskError, in_order
from tvist_lab.runners.cluster import Cluster
from tvist_lab.runners.parcels import do, pack, unpack
from tvist_lab.study.case import Case
from tvist_lab.study.engine import made
from tvist_lab.study.method import Named
from tvist_lab.study.moves import draw_moves
from tvist_lab.study.recipes import Recipe
from tvist_lab.study.work import Job, measure

ROOT = str(Path(__file__).parents[2])
LOCAL = [Processes(few=2, chunk=3), Cluster(processes=2)]


class Backwards:
    """A runner whose last task ends first."""

    def run(self, work, tasks):
        for index in reversed(range(len(tasks))):
            yield index, work(tasks[index])


class TestOrder:
    def test_results_are_in_the_order_of_the_tasks_whatever_ends_first(self):
        assert list(in_order(Backwards(), square, range(10))) == [n * n for n in range(10)]

    def test_the_first_failure_is_raised_after_the_results_before_it(self):
        results = in_order(Processes(few=99), square_or_raise, range(20))
        assert list(itertools.islice(results, 7)) == [n * n for n in range(7)]
        with pytest.raises(KeyError, match="task 7"):
            next(results)

    def test_evaluations_do_not_depend_on_what_runs_them(self, ur5e):
        moves = draw_moves(ur5e, 17, 1, (0.0, 5.0)).moves  # enough for other processes
        zv = (Named(Recipe("zv", load_calibration("ur5e_5kg")), "zv"),)
        jobs = [Job(Case(ur5e, move, seed), zv) for seed, move in enumerate(moves)]
        here = [measure(job) for job in jobs]
        assert list(made(jobs)) == here
        assert list(made(jobs[:2], Backwards())) == here[:2]


class TestParcels:
    def test_what_cannot_be_pickled_is_a_failure_with_the_reason(self):
        one = pack(threading.Lock())
        assert isinstance(one, Failed)
        assert "cannot be pickled" in str(one.error)
        assert "lock" in str(one.error)

    def test_a_result_that_cannot_be_pickled_fails_its_task_alone(self):
        outcomes = [unpack(one) for one in do(function_of, [pack(n) for n in range(5)])]
        assert [outcomes[n] for n in (0, 1, 2, 4)] == [0, 1, 2, 4]
        assert "its result cannot be pickled" in str(outcomes[3].error)

    def test_an_exception_comes_back_as_it_was_raised_with_its_traceback(self):
        (packed,) = do(square_or_raise, [pack(7)])
        error = unpack(packed).error
        assert type(error) is KeyError
        assert "runner_work.py" in error.__notes__[0]

    def test_an_exception_with_a_constructor_of_its_own_comes_back_at_least_in_words(self):
        (packed,) = do(square_or_raise, [pack(8)])
        error = unpack(packed).error
        assert type(error) in {OddError, TaskError}  # Dask teaches pickle how to do it
        assert str(error) in {"odd 8", "OddError: odd 8"}


class TestFew:
    def test_few_tasks_are_done_in_this_process_and_fail_alike(self):
        got = dict(Processes(few=20).run(square_or_raise, range(10)))
        assert [got[n] for n in range(7)] == [n * n for n in range(7)]
        assert isinstance(got[7].error, KeyError)
        assert type(got[8].error).__name__ == "OddError"


class TestOthers:
    @pytest.fixture(autouse=True)
    def importable(self, monkeypatch):
        """Other processes import the work by its name; they inherit this path."""
        monkeypatch.syspath_prepend(ROOT)

    @pytest.mark.parametrize("runner", LOCAL, ids=lambda one: type(one).__name__)
    def test_each_task_gets_its_own_result_or_failure(self, runner):
        tasks = [*range(30), threading.Lock()]
        got = dict(runner.run(square_or_raise, tasks))
        assert sorted(got) == list(range(31))
        failed = {index: one.error for index, one in got.items() if isinstance(one, Failed)}
        assert sorted(failed) == [7, 8, 17, 18, 27, 28, 30]
        assert all(type(failed[index]) is KeyError for index in (7, 17, 27))
        assert all(got[index] == index**2 for index in range(30) if index not in failed)
        assert "cannot be pickled" in str(failed[30])

    def test_a_process_that_dies_ends_a_short_run_in_a_sentence(self):
        with pytest.raises(ChildProcessError, match="a process died"):
            list(Processes(few=2).run(die, range(20)))

    def test_a_worker_that_dies_costs_nothing_if_its_task_can_be_done_again(self, tmp_path):
        tasks = [(number, str(tmp_path / "mark")) for number in range(30)]
        got = dict(Cluster(processes=2).run(die_once, tasks))
        assert (tmp_path / "mark").exists()
        assert got == {number: number * number for number in range(30)}

    def test_a_task_that_kills_each_worker_fails_alone(self):
        got = dict(Cluster(processes=2).run(die, range(30)))
        assert isinstance(got[5], Failed)
        assert "every worker that did it died" in str(got[5].error)
        assert all(got[number] == number * number for number in range(30) if number != 5)

    def test_an_address_without_a_scheduler_is_told(self, monkeypatch):
        monkeypatch.setattr("tvist_lab.runners.cluster.PATIENCE", 1.0)
        with pytest.raises(ConnectionError, match=r"no Dask scheduler answers at tcp://127\.0\.0\.1:1$"):
            list(Cluster("tcp://127.0.0.1:1").run(square, range(3)))
