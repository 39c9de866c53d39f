"""A kit for tests of programs that move a robot: fixtures, markers and assertions for pytest.

`pip install 'tvist[testing]'` is all that a project needs: pytest finds the fixtures by itself.
"""

from tvist_testing.assertions import (
    assert_residual_vibration_below,
    assert_settles_within,
    assert_within_limits,
)

__all__ = ["assert_residual_vibration_below", "assert_settles_within", "assert_within_limits"]
