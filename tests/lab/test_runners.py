"""Every executor gives each task its result or its failure, whatever happens to the others."""

import threading
from contextlib import nullcontext
from pathlib import Path

import dask
import pytest
from distributed import Client, LocalCluster
from polars.testing import assert_frame_equal
from tests.lab.runner_work import die, square_or_raise

from tvist_controller.sources.calibrations import load as load_calibration
from tvist_lab.runners import Failed, InlineExecutor, TaskError, outcomes, processes
from tvist_lab.study.case import Case
from tvist_lab.study.catalogue import some
from tvist_lab.study.engine import run
from tvist_lab.study.moves import draw_moves
from tvist_lab.study.study import Study
from tvist_lab.study.work import measure

ROOT = str(Path(__file__).parents[2])


@pytest.fixture(scope="module", autouse=True)
def _importable():
    """Other processes import the work by its name; they inherit this path."""
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(ROOT)
        yield


@pytest.fixture(scope="module")
def cluster(_importable):
    """A Dask cluster on this machine, which gives up a task that has ended two workers."""
    with (
        dask.config.set({"distributed.scheduler.allowed-failures": 1}),
        LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None, silence_logs=60) as local,
        Client(local, set_as_default=False) as client,
    ):
        yield client.get_executor(pure=False)
        client.wait_for_workers(2)  # Dask cannot end a worker that it is just starting again


EXECUTORS = {
    "processes": lambda _: processes(2),
    "dask": lambda request: nullcontext(request.getfixturevalue("cluster")),
    "here": lambda _: InlineExecutor(),
}


@pytest.mark.parametrize("number", [1, pytest.param(2, marks=pytest.mark.nightly)])
def test_study_results_are_equal_in_one_and_in_several_processes(ur5e, number):
    methods = some(["zv"], ur5e, load_calibration("ur5e_5kg"))
    moves = draw_moves(ur5e, 2, 1, (0.0, 5.0)).moves
    cases = [Case(ur5e, move, seed) for seed, move in enumerate(moves)]
    study = Study(title="", cases=cases, methods=methods)
    here = [{"case": place, **row} for place, job in enumerate(study.jobs()) for row in measure(job)]
    assert_frame_equal(run(study).rows, study.frame(here))
    assert_frame_equal(run(study, executor=lambda: processes(number)).rows, study.frame(here))


@pytest.mark.parametrize("executor", EXECUTORS.values(), ids=EXECUTORS)
def test_each_task_gets_its_result_or_failure(executor, request):
    tasks = [*range(30), threading.Lock()]
    with executor(request) as pool:
        got = dict(outcomes(pool, square_or_raise, tasks))
    assert sorted(got) == list(range(31))
    failed = {index: one.error for index, one in got.items() if isinstance(one, Failed)}
    assert sorted(failed) == [7, 8, 9, 17, 18, 19, 27, 28, 29, 30]
    assert all(got[index] == index**2 for index in range(30) if index not in failed)
    assert all(type(failed[index]) is KeyError for index in (7, 17, 27))
    assert "runner_work.py" in failed[7].__notes__[0]
    assert str(failed[8]) in {"odd 8", "OddError: odd 8"}  # Dask teaches pickle how to do it
    assert isinstance(failed[9], TaskError)
    assert "its result cannot be pickled" in str(failed[9])
    assert str(failed[30]).startswith("it cannot be pickled: ")
    assert "lock" in str(failed[30])


def test_ended_worker_process_ends_the_run():
    with pytest.raises(ChildProcessError, match="a worker process ended"), processes(2) as pool:
        list(outcomes(pool, die, range(20)))


def test_task_that_ends_every_worker_fails(cluster):
    got = dict(outcomes(cluster, die, range(30)))
    assert "died" in str(got[5].error)
    assert sum(isinstance(one, Failed) for one in got.values()) <= 3
