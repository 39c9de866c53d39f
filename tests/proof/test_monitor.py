"""The proof of the monitor counts what robots say: its arms change, and one of them is noticed."""

import pytest
from proof.monitor.measure import Outcome, outcome


@pytest.mark.parametrize("change", ["payload", "springs"])
def test_a_hidden_robot_notices_a_change_and_nothing_before(change):
    found = outcome("ur5e", change, "none", 1)
    assert found.noticed is not None
    assert found.alarms == 0


def test_the_same_seed_says_the_same():
    assert (
        outcome("ur5-light", "nothing", "zv", 2)
        == outcome("ur5-light", "nothing", "zv", 2)
        == Outcome(0, 20, None)
    )
