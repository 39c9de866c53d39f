"""Keys: a name is one chunk, and never a wildcard."""

from functools import partial
from typing import get_args

import pytest

from tvist_protocol import ProtocolError, keys
from tvist_protocol.channels import CHANNELS

LEAVES = [leaf for leaf in get_args(keys.Leaf) if leaf != "client"]


def test_a_clients_key_and_its_name_back():
    key = keys.client("ur5e", "palletizer 2")
    assert key == "tvist/ur5e/client/palletizer 2"
    assert keys.client_of("ur5e", key) == ("palletizer 2", "")
    assert keys.any_client("ur5e") == "tvist/ur5e/client/**"
    assert keys.ANY_ALIVE == "tvist/*/alive"


@pytest.mark.parametrize("session", ["1", "81fda21f27353ac9aa45cc45f98872fc"])
def test_a_clients_key_may_say_which_session_it_is_of(session):
    key = keys.client("ur5e", "palletizer 2", session)
    assert key == f"tvist/ur5e/client/palletizer 2/{session}"
    assert keys.client_of("ur5e", key) == ("palletizer 2", session)


@pytest.mark.parametrize("session", ["*", "A1", "a/b", "x", "a" * 33, "a\n", " "])
def test_what_is_no_session_is_refused(session):
    with pytest.raises(ProtocolError) as caught:
        keys.client("ur5e", "a", session)
    assert (caught.value.code, caught.value.where) == ("out_of_range", "session")


NO_CLIENTS = [
    *(f"tvist/ur5e/client{rest}" for rest in ("/*", "/a/", "/a/x", "/a/b/c", "/a/**", "//b", "", "/")),
    *("tvist/ur10/client/a", "x", ""),
]


@pytest.mark.parametrize("key", NO_CLIENTS)
def test_a_key_that_is_no_clients_has_neither_name_nor_session(key):
    assert keys.client_of("ur5e", key) is None


@pytest.mark.parametrize("name", ["a", "0", "ur5e", "cell-3_left", "a" * 64])
def test_robot_names(name):
    assert keys.check_robot_name(name) == name


NO_ROBOTS = [
    *("", "*", "**", "a*", "$*", "a/b", "UR5e", "_a", "-a", "ä", "a#", "a?", "@a", "a b", "a\n", "a" * 65),
    *(None, 5, b"a"),
]


@pytest.mark.parametrize("name", NO_ROBOTS)
def test_what_is_no_robot_name_is_refused_by_every_key(name):
    for made in (partial(keys.key, leaf="state"), keys.any_client, keys.check_robot_name):
        with pytest.raises(ProtocolError) as caught:
            made(name)
        assert (caught.value.code, caught.value.where) == ("out_of_range", "robot")
        assert "a-z 0-9" in caught.value.why


@pytest.mark.parametrize(
    "name", ["", "*", "a*", "a/b", "a$", "a?", "a#", "@a", "a\n", "a\x00", "ä", "a" * 65]
)
def test_what_is_no_client_name_is_refused(name):
    with pytest.raises(ProtocolError) as caught:
        keys.client("ur5e", name)
    assert (caught.value.code, caught.value.where) == ("out_of_range", "client")


def test_the_table_of_keys_is_what_the_functions_build():
    built = {channel.key.format(robot="r", client="c") for channel in CHANNELS}
    assert built == {keys.key("r", leaf) for leaf in LEAVES} | {keys.client("r", "c")}
