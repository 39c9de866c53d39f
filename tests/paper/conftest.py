"""The paper's experiment, run once for all tests that look at it."""

import pytest

from tvist_lab.in_process import free_setup
from tvist_lab.studies.paper.experiment import Experiment, simulate


@pytest.fixture(scope="session")
def done() -> Experiment:
    """Two runs of each motion with a seed that nothing was tuned with."""
    return simulate(free_setup(seed=77), runs=2, seed=77)


@pytest.fixture(scope="session")
def with_baselines() -> Experiment:
    return simulate(free_setup(seed=5), runs=1, seed=5, baselines=True)
