"""Robots spread over processes: each is served once, and options that exclude workers are refused."""

import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.examples import examples

from tvist_server.assembly import check_together, shares
from tvist_server.config import from_mapping
from tvist_server.gateways.access import open_access, with_robots_behind
from tvist_server.option_values import StartError


@examples(20)
@given(st.integers(1, 200), st.data())
def test_robots_are_spread_evenly_over_processes(robots, data):
    workers = data.draw(st.integers(1, robots))
    parts = shares(robots, workers)
    assert [number for part in parts for number in part] == list(range(robots))
    sizes = [len(part) for part in parts]
    assert len(sizes) == workers
    assert max(sizes) - 1 <= min(sizes) >= 1


@pytest.mark.parametrize(
    ("content", "named"),
    [
        ({"connect": ["tcp/h:1"], "listen": ["tcp/h:2"]}, "connect, listen and workers exclude each other"),
        ({"connect": ["tcp/h:1"], "metrics": "9447"}, "connect, metrics and workers exclude each other"),
        ({"listen": ["unixsock-stream//tmp/x"]}, "Unix sockets are for the server's own"),
    ],
)
def test_options_that_exclude_workers_are_refused(content, named):
    config = from_mapping({"workers": 2, "robots": "ur5e*2", **content}, "configuration")
    with pytest.raises(StartError, match=named):
        check_together(config, 2)


def test_only_the_private_protocol_may_publish_for_robots_behind():
    access = with_robots_behind(open_access(["a"]), ["a"], "", "unixsock-stream")
    subjects = {subject["id"]: subject for subject in access["subjects"]}
    puts = [rule for rule in access["rules"] if "put" in rule["messages"] and "ingress" in rule["flows"]]
    publishing = {rule["id"] for rule in puts if "tvist/a/state" in rule["key_exprs"]}
    assert publishing
    for policy in access["policies"]:
        if publishing & set(policy["rules"]):
            assert [subjects[name]["link_protocols"] for name in policy["subjects"]] == [["unixsock-stream"]]
