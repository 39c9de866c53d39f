"""Places at the interfaces: how many, and for whom some are kept."""

from dataclasses import dataclass

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tvist_server.gateways.ur.connection import KEPT, MOST, ConnectionLimit, _is_loopback


@dataclass(eq=False)
class Client:
    heard: float = 0.0
    dispensable: bool = False
    peer: str = "x"
    gone: bool = False

    def disconnect(self):
        self.gone = True


def places(*clients, said=None):
    made = ConnectionLimit(lambda: 100.0, (said if said is not None else []).append)
    made.taken.update(clients)
    return made


def test_some_places_are_kept_for_this_machine():
    said = []
    house = places(*(Client() for _ in range(MOST - KEPT)), said=said)
    assert not house.make_room("far", local=False)
    assert "8 are kept for this machine" in said[0]
    for _ in range(KEPT):
        assert house.make_room("near", local=True)
        house.taken.add(Client())
    assert not house.make_room("near", local=True)


@given(st.lists(st.tuples(st.floats(0, 100), st.booleans()), min_size=200, max_size=MOST))
def test_whoever_goes_is_dispensable_and_nobody_such_has_been_silent_for_longer(clients):
    all_of_them = [Client(*client) for client in clients]
    said = []
    house = places(*all_of_them, said=said)
    came_in = house.make_room("new", local=True)
    gone = [client for client in all_of_them if client.gone]
    candidates = [client for client in all_of_them if client.dispensable]
    if len(clients) < 0.9 * MOST or not candidates:
        assert not gone
    else:
        (one,) = gone
        assert one.heard == min(client.heard for client in candidates)
        assert one not in house.taken
    assert came_in == (len(house.taken) < MOST)
    assert len(said) == len(gone) + (not came_in)


@pytest.mark.parametrize(
    ("host", "local"),
    {
        "127.0.0.1": True,
        "127.20.3.4": True,
        "::1": True,
        "::ffff:127.0.0.1": True,
        "10.0.0.2": False,
        "fe80::1%eth0": False,
        "::ffff:10.0.0.2": False,
    }.items(),
)
def test_who_is_on_this_machine(host, local):
    assert _is_loopback(host) == local
