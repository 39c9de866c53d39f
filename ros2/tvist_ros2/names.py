"""How rmw_zenoh names things on the network: keys of topics and services, and tokens by which nodes see each other."""

from itertools import count
from typing import Literal, NamedTuple

from tvist_ros2.messages import RosType

Kind = Literal["MP", "MS", "SS"]
"""What a token announces: a publisher, a subscription, a service."""


class Qos(NamedTuple):
    """Quality of service of a topic or service; the history keeps the last `depth` messages."""

    depth: int = 10
    reliable: bool = True
    latched: bool = False
    """True if later subscribers get the last messages; ROS 2 calls this transient local."""

    def __str__(self) -> str:
        """Return rmw_zenoh's text, which leaves out defaults."""
        reliability, durability = "" if self.reliable else "2", "1" if self.latched else ""
        return f"{reliability}:{durability}:,{self.depth}:,:,:,,"


DEFAULT = Qos()


def absolute(namespace: str, name: str) -> str:
    """Return the full name of a topic or service: a name that begins with / is one already."""
    return name if name.startswith("/") else f"{namespace}/{name}"


def key(domain: int, name: str, of: RosType) -> str:
    """Return the key of a topic or service with an absolute name."""
    return f"{domain}{name}/{_dds(of)}"


class Tokens:
    """Writes the liveliness tokens of one node and numbers what they announce."""

    def __init__(self, domain: int, session: str, namespace: str, node: str) -> None:
        self._start = f"@ros2_lv/{domain}/{session}/0"
        self._owner = f"%/{namespace.replace('/', '%') or '%'}/{node}"
        self._numbers = count()

    def node(self) -> str:
        """Return the token of the node, which must be the first one."""
        return f"{self._start}/{next(self._numbers)}/NN/{self._owner}"

    def entity(self, kind: Kind, name: str, of: RosType, qos: Qos = DEFAULT) -> str:
        """Return the token of a publisher, a subscription or a service with an absolute name."""
        what = f"{name.replace('/', '%')}/{_dds(of)}/{qos}"
        return f"{self._start}/{next(self._numbers)}/{kind}/{self._owner}/{what}"


def _dds(of: RosType) -> str:
    """Return name and hash of a type as DDS names it."""
    package, group, name = of.name.split("/")
    return f"{package}::{group}::dds_::{name}_/RIHS01_{of.hash}"
