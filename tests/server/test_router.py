"""Rates of a router: each listed robot has its own, which it shares with no other."""

import pytest
import zenoh

from tvist_server.gateways.router import Rate, downsampling, robots_of


@pytest.mark.parametrize(
    ("listed", "matching"), [(("left", "hall-3/ur5e*2"), [1, 1, 1, 0]), ((), [1, 1, 1, 1])]
)
def test_a_state_matches_the_rule_of_its_robot_only(listed, matching):
    """Zenoh takes any one of several matching rules, and counts the states of all robots that it matches."""
    robots = [place for text in listed for place in robots_of(text)]
    (settings,) = downsampling([Rate.read("10@eth1")], robots)
    assert (settings["interfaces"], {rule["freq"] for rule in settings["rules"]}) == (["eth1"], {10.0})
    found = []
    for place in ("tvist/left", "hall-3/tvist/ur5e-1", "hall-3/tvist/ur5e-2", "tvist/ur5e-1"):
        rules = [zenoh.KeyExpr(rule["key_expr"]) for rule in settings["rules"]]
        found.append([str(rule) for rule in rules if rule.intersects(zenoh.KeyExpr(f"{place}/state"))])
    assert [len(rules) for rules in found] == matching
    assert len({rule for rules in found for rule in rules}) == (3 if listed else 1)
