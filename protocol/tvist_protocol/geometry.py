"""Shape and kinematics of an arm, so that a client can draw it."""

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
"""A frame in another one: x y z [m], and roll, pitch and yaw about its fixed axes [rad], as in a URDF."""


class Mesh(Struct, frozen=True, kw_only=True, gc=False):
    """A mesh from a URDF that shows a part of the arm."""

    link: int
    """Index of the link in whose frame it is placed; -1 for the base frame."""
    file: str
    """Its file on the server's machine."""
    placement: Origin
    """Its frame in that of the link."""
    scale: tuple[float, float, float] = (1.0, 1.0, 1.0)
    """Factors of its coordinates [-]."""


class WorldShape(Struct, frozen=True, kw_only=True, gc=False):
    """A primitive shape of the world around the arm."""

    kind: str
    """`plane`, `sphere`, `capsule`, `ellipsoid`, `cylinder` or `box`; a client omits kinds that it does not know."""
    size: list[float]
    """By kind [m]: radius; radius and half length along z; half lengths, 0 where a plane is unbounded."""
    pose: list[float]
    """Pose in the frame of its body: x y z [m] and rotation vector [rad]."""
    body: int | None
    """Number of the body that carries it; null: it is fixed, in the base frame."""
    colour: list[float]
    """Red, green, blue and opacity, 0 to 1."""


class World(Struct, frozen=True, kw_only=True, gc=False):
    """The surroundings that a simulated arm can touch."""

    name: str
    """Name of the scene, or its file."""
    bodies: list[str]
    """Names of the moving bodies, in the order of `body_poses` in `truth`."""
    shapes: list[WorldShape]
    """The visible shapes."""
    unseen: int = 0
    """Number of shapes that are omitted because they are meshes."""


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
    """Frame of each link in that of its joint, for an arm from a URDF; then `a`, `d` and `alpha` are empty."""
    bending: list[int] = []
    """Indices of the links that bend, in order. Each has two values in `link_deflection` of `truth`:
    rotations about y, then z, in the middle of the link, after Tx(a/2) Tz(d) from its joint."""
    capsules: list[Capsule] = []
    """Parts of the arm, from the base on."""
    meshes: list[Mesh] = []
    """Meshes to draw instead of the capsules, if their files are present."""
    payload_radius: float = 0.05
    """Radius of the capsule from the flange through the payload's centre of mass to twice its distance [m]."""
    floor: float = 0.0
    """Height of the floor [m]."""
    has_floor: bool = True
    """Whether there is a floor, which motions keep clear of."""
    world: World | None = None
    """Surroundings of the arm; null if it touches nothing."""
