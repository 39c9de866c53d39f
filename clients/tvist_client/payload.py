"""Payloads from plain sequences of numbers."""

from collections.abc import Iterable

from tvist_client.values import floats, number
from tvist_protocol.values import Payload


def make_payload(mass: float, com: Iterable[float], inertia: Iterable[float]) -> Payload:
    """Create a payload.

    Args:
        mass: Mass [kg].
        com: Centre of mass x y z in the flange frame [m].
        inertia: xx xy xz yy yz zz about the centre of mass, flange axes [kg m²].

    Raises:
        ArgumentError: An argument is not a number, or has the wrong number of entries.
    """
    x, y, z = floats(com, "com", "x y z")
    xx, xy, xz, yy, yz, zz = floats(inertia, "inertia", "xx xy xz yy yz zz")
    return Payload(mass=number(mass, "mass"), com=(x, y, z), inertia=(xx, xy, xz, yy, yz, zz))
