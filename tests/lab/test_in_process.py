"""A robot in process is set up as it was asked for: nothing that is given is left out."""

import pytest

from tvist_lab.in_process import free_setup
from tvist_server.config import ServeConfig
from tvist_server.option_values import StartError


def test_given_options_override_the_configuration_in_process():
    for config in (None, ServeConfig(seed=1, shaper="ei"), ServeConfig()):
        found = free_setup(config, seed=7, shaper="zvd", start="Q2")
        assert (found.seed, found.shaper, found.clock) == (7, "zvd", "free")
        assert found.q == found.description.poses["Q2"]


def test_unchanged_options_are_those_of_the_configuration():
    found = free_setup(ServeConfig(shaper="ei", clock="lockstep"), seed=7)
    assert (found.shaper, found.clock, found.truth) == ("ei", "lockstep", False)


@pytest.mark.parametrize("config", [None, ServeConfig()])
def test_unknown_option_is_refused(config):
    with pytest.raises(StartError, match="'shapr': did you mean 'shaper'"):
        free_setup(config, shapr="zv")
