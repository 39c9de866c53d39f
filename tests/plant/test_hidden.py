"""A hidden robot is drawn from its seed alone, within its shares, and differs from its file in these values only."""

import msgspec
import numpy as np
import pytest

from tvist_plant.description import Payload, load
from tvist_plant.robot_checks import is_real_body
from tvist_plant.variants import CENTRE, DRIVES, LINKS, MASS, hidden, hidden_payload

UR5E = load("ur5e")


@pytest.mark.parametrize("robot", ["ur5e", "one-joint"])
def test_a_hidden_robot_differs_from_its_file_within_the_shares_and_nowhere_else(robot: str) -> None:
    """All drawn values are within their shares over many seeds, reach both halves, and nothing else changes."""
    known = load(robot)
    ratios: dict[str, list[float]] = {name: [] for name in (*DRIVES, *LINKS)}
    for seed in range(60):
        found = hidden(known, seed)
        for table, shares in (("drives", DRIVES), ("link_flexibility", LINKS)):
            for name, share in shares.items():
                before, after = (np.atleast_1d(getattr(getattr(one, table), name)) for one in (known, found))
                assert np.all(np.abs(after - before) <= share * before * (1.0 + 1e-12))
                ratios[name] += (after[before > 0.0] / before[before > 0.0]).tolist()
        back = {
            table: msgspec.structs.replace(
                getattr(found, table), **{name: getattr(getattr(known, table), name) for name in shares}
            )
            for table, shares in (("drives", DRIVES), ("link_flexibility", LINKS))
        }
        assert msgspec.structs.replace(found, **back) == known
    for name, share in (DRIVES | LINKS).items():
        if ratios[name]:
            assert min(ratios[name]) < 1.0 - 0.8 * share
            assert max(ratios[name]) > 1.0 + 0.8 * share


def test_the_same_seed_gives_the_same_robot_and_another_seed_another() -> None:
    """The draw depends on the seed alone."""
    assert hidden(UR5E, 11) == hidden(UR5E, 11) != hidden(UR5E, 12)
    assert hidden_payload(UR5E.payload, 11) == hidden_payload(UR5E.payload, 11)


def test_what_is_carried_is_a_real_body_near_the_declared_one() -> None:
    """Mass and centre are within their limits, no payload stays none, and inertia grows with the mass."""
    for seed in range(60):
        carried = hidden_payload(UR5E.payload, seed)
        assert abs(carried.mass / UR5E.payload.mass - 1.0) <= MASS
        assert np.max(np.abs(np.array(carried.com) - UR5E.payload.com)) <= CENTRE
        assert is_real_body(carried.inertia)
        assert carried.inertia[0] / UR5E.payload.inertia[0] == pytest.approx(carried.mass / UR5E.payload.mass)
        assert hidden_payload(Payload(), seed) == Payload()
