"""Names in keys are one chunk each and contain no wildcard."""

from functools import partial
from typing import get_args

import pytest

from tvist_protocol import ProtocolError, keys
from tvist_protocol.channels import CHANNELS

LEAVES = [leaf for leaf in get_args(keys.Leaf) if leaf != "client"]


def test_a_client_key_contains_the_client_name():
    key = keys.client("ur5e", "palletizer 2")
    assert key == "tvist/ur5e/client/palletizer 2"
    assert keys.client_of("ur5e", key) == ("palletizer 2", "")
    assert keys.any_client("ur5e") == "tvist/ur5e/client/**"
    assert keys.ANY_ALIVE == "tvist/*/alive"


@pytest.mark.parametrize("session", ["1", "81fda21f27353ac9aa45cc45f98872fc"])
def test_a_client_key_may_contain_a_session(session):
    key = keys.client("ur5e", "palletizer 2", session)
    assert key == f"tvist/ur5e/client/palletizer 2/{session}"
    assert keys.client_of("ur5e", key) == ("palletizer 2", session)


NO_CLIENTS = [
    *(f"tvist/ur5e/client{rest}" for rest in ("/*", "/a/", "/a/x", "/a/b/c", "/a/**", "//b", "", "/")),
    *("tvist/ur10/client/a", "x", ""),
]


@pytest.mark.parametrize("key", NO_CLIENTS)
def test_other_keys_have_neither_client_name_nor_session(key):
    assert keys.client_of("ur5e", key) is None


@pytest.mark.parametrize("name", ["a", "0", "ur5e", "cell-3_left", "a" * 64])
def test_valid_robot_names_are_accepted(name):
    assert keys.check_robot_name(name) == name


NO_ROBOTS = [
    *("", "*", "**", "a*", "$*", "a/b", "UR5e", "_a", "-a", "ä", "a#", "a?", "@a", "a b", "a\n", "a" * 65),
    *(None, 5, b"a"),
]
NO_CLIENT_NAMES = ["", "*", "a*", "a/b", "a$", "a?", "a#", "@a", "a\n", "a\x00", "ä", "a" * 65]
NO_SESSIONS = ["*", "A1", "a/b", "x", "a" * 33, "a\n", " "]
MAKERS = [
    *(
        ("robot", NO_ROBOTS, make)
        for make in (partial(keys.key, leaf="state"), keys.any_client, keys.check_robot_name)
    ),
    ("client", NO_CLIENT_NAMES, partial(keys.client, "ur5e")),
    ("session", NO_SESSIONS, partial(keys.client, "ur5e", "a")),
]


@pytest.mark.parametrize(("where", "names", "make"), MAKERS)
def test_an_invalid_name_is_refused(where, names, make):
    for name in names:
        with pytest.raises(ProtocolError, match="out_of_range") as caught:
            make(name)
        assert caught.value.where == where


def test_the_table_of_keys_matches_the_functions():
    built = {channel.key.format(robot="r", client="c") for channel in CHANNELS}
    assert built == {keys.key("r", leaf) for leaf in LEAVES} | {keys.client("r", "c")}
