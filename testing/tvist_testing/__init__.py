"""A test kit for programs that move a robot: fixtures, markers and assertions for pytest.

Install it with `pip install 'tvist[testing]'`; pytest finds the fixtures by itself.
"""

from tvist_testing.assertions import (
    assert_residual_vibration_below,
    assert_settles_within,
    assert_within_limits,
)

__all__ = ["assert_residual_vibration_below", "assert_settles_within", "assert_within_limits"]
