"""The paper's experiment, run once for all tests that look at it."""

import asyncio

import pytest

from tvist_lab.in_process import free_setup, robot_in_process
from tvist_lab.studies.paper.experiment import Experiment, experiment


def run(runs: int, seed: int, *, baselines: bool) -> Experiment:
    async def whole() -> Experiment:
        async with robot_in_process(free_setup(seed=seed)) as robot, robot.control("test") as arm:
            return await experiment(
                robot, arm, runs=runs, seed=seed, baselines=baselines, progress=lambda _: None
            )

    return asyncio.run(whole())


@pytest.fixture(scope="session")
def done() -> Experiment:
    """Two runs of each motion with a seed that nothing was tuned with."""
    return run(2, 77, baselines=False)


@pytest.fixture(scope="session")
def with_baselines() -> Experiment:
    return run(1, 5, baselines=True)
