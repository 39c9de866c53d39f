"""The first example: the parts that compute. That it runs against a robot is the system's test."""

import importlib.util
import re
from pathlib import Path

import numpy as np
import pytest

EXAMPLE = Path(__file__).parents[2] / "clients/examples/01_bare_client.py"


@pytest.fixture(scope="module")
def bare():
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("sys.argv", ["01_bare_client.py"])
        spec = importlib.util.spec_from_file_location("bare_client", EXAMPLE)
        module = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(module)
    return module


@pytest.mark.parametrize("lag", [1.0, 7.3, 10.04, 36.25, 80.9])
def test_the_delay_is_found_between_samples(bare, lag):
    t = np.arange(5000) * bare.TICK
    reference = [bare.swing(x) for x in t]
    target = [bare.swing(max(0.0, x - lag * bare.TICK)) for x in t]
    assert bare.delay(reference, target) == pytest.approx(lag, abs=0.02)


def test_it_uses_none_of_our_packages():
    imported = re.findall(r"^\s*(?:import|from) (\w+)", EXAMPLE.read_text(), re.MULTILINE)
    assert not [name for name in imported if name.startswith("tvist")]
    assert {"msgpack", "zenoh"} <= set(imported)
