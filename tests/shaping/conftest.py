import json
from pathlib import Path

import pytest
from hypothesis import settings

# The first example of a test may compile a kernel; that is no reason to fail.
settings.register_profile("compiling", deadline=None)
settings.load_profile("compiling")


@pytest.fixture(scope="session")
def golden():
    """Amplitudes, times and sensitivities computed before this code existed."""
    return json.loads(Path(__file__).with_name("golden_shapers.json").read_text())
