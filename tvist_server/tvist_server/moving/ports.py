"""TCP ports of a robot's interfaces that are used to move it."""

from typing import NamedTuple

from tvist_server.watching.place import PORT, Place

DASHBOARD, PRIMARY = 29999, 30001


class Ports(NamedTuple):
    """Where its other interfaces are: each as far from that of RTDE as on a robot of UR's."""

    dashboard: Place
    """Questions and answers in text."""
    primary: Place
    """Its configuration, and the way in for programs."""


def ports_of(place: Place) -> Ports:
    """Return the places for that of RTDE."""
    offset = place.port - PORT
    return Ports(place._replace(port=DASHBOARD + offset), place._replace(port=PRIMARY + offset))
