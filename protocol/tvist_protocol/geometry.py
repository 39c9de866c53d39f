"""What an arm looks like and how it is built, so that a client can draw it."""

from msgspec import Struct

from tvist_protocol.values import Vec3

GEOMETRY_VERSION = 1


class Capsule(Struct, frozen=True, kw_only=True, gc=False):
    """A capsule that contains a part of the arm."""

    name: str
    """Name of the part."""
    link: int
    """Index of the link in whose Denavit-Hartenberg frame the capsule stands; -1 for the base frame."""
    start: Vec3
    """One end of its axis [m]."""
    end: Vec3
    """Other end of its axis [m]."""
    radius: float
    """Radius [m]."""


Origin = tuple[float, float, float, float, float, float]
"""A frame in another: x y z [m], and roll, pitch and yaw about its fixed axes [rad], as in a URDF."""


class Mesh(Struct, frozen=True, kw_only=True, gc=False):
    """A mesh of a URDF that shows a part of the arm."""

    link: int
    """Index of the link in whose frame it stands; -1 for the base frame."""
    file: str
    """Its file on the server's machine."""
    placement: Origin
    """Its frame in that of the link."""
    scale: tuple[float, float, float] = (1.0, 1.0, 1.0)
    """Factors of its coordinates [-]."""


class WorldShape(Struct, frozen=True, kw_only=True, gc=False):
    """A primitive shape of the world around the arm."""

    kind: str
    """`plane`, `sphere`, `capsule`, `ellipsoid`, `cylinder` or `box`; a client leaves out what it does not know."""
    size: list[float]
    """Radius; radius and half of the length along z; half of the lengths; of a plane 0 where it has no end [m]."""
    pose: list[float]
    """In the frame of its body: x y z [m] and rotation vector [rad]."""
    body: int | None
    """Number of the body that carries it; null: it stands still, in the frame of the base."""
    colour: list[float]
    """Red, green, blue and opacity, 0 to 1."""


class World(Struct, frozen=True, kw_only=True, gc=False):
    """What stands around a simulated arm that touches it."""

    name: str
    """Name of the scene, or its file."""
    bodies: list[str]
    """Names of the bodies that move, in the order of `body_poses` in `truth`."""
    shapes: list[WorldShape]
    """What can be seen."""
    unseen: int = 0
    """Number of shapes that are left out, since they are meshes."""


class Geometry(Struct, frozen=True, kw_only=True, gc=False):
    """Kinematics and shape of the arm. Joint i turns about z, then follows Tz(d) Tx(a) Rx(alpha), or its placement."""

    version: int = GEOMETRY_VERSION
    """Version of this description; a client that does not know it draws nothing."""
    a: list[float]
    """Denavit-Hartenberg link lengths, one per joint [m]."""
    d: list[float]
    """Denavit-Hartenberg link offsets, one per joint [m]."""
    alpha: list[float]
    """Denavit-Hartenberg link twists, one per joint [rad]."""
    placement: list[Origin] = []
    """Frame of each link in that of its joint, for an arm from a URDF; `a`, `d` and `alpha` are empty then."""
    bending: list[int] = []
    """Indices of the links that bend, in order. Each has two values in `link_deflection` of `truth`: rotations about y
    and then z, in the middle of the link, after Tx(a/2) Tz(d) from its joint."""
    capsules: list[Capsule] = []
    """Parts of the arm, from the base on."""
    meshes: list[Mesh] = []
    """Meshes that show the arm instead, if the file is there."""
    payload_radius: float = 0.05
    """Radius of the capsule from the flange through the centre of mass of the payload to twice its distance [m]."""
    floor: float = 0.0
    """Height of the floor [m]."""
    has_floor: bool = True
    """Whether there is a floor, which motions keep clear of."""
    world: World | None = None
    """What stands around the arm; null if it touches nothing."""
