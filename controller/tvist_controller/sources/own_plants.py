"""Plants by name: `VARIANTS`, files given as FILE.py:NAME, installed packages."""

from collections.abc import Callable
from dataclasses import dataclass, field
from importlib.metadata import entry_points
from typing import Any

from msgspec import Struct

from tvist_controller.sources.own_files import OwnFileError, ends, is_file, is_of_file, load_again, run_file
from tvist_plant.description import Payload, RobotDescription
from tvist_plant.foreign import called, is_plant
from tvist_plant.plant import Plant, PlantError
from tvist_plant.user_file import named
from tvist_plant.variants import VARIANTS, Variant
from tvist_plant.world.scene_file import SceneError, find_scene

GROUP = "tvist.plants"  # entry-point group for plants of installed packages
WORLD = "world:"  # prefix of the place of a plant that is the arm in a scene
Maker = Callable[[RobotDescription, Payload], Plant]
"""Makes a plant from a robot's description and its carried payload."""


class RecordedPlant(Struct, frozen=True):
    """Reference to a plant in a recording."""

    place: str
    """FILE.py:NAME, a name of `VARIANTS` or of an installed plant, or `WORLD` and a scene."""
    sha256: str = ""
    """SHA-256 of the file in hexadecimal; empty for an installed plant."""


@dataclass(frozen=True)
class OwnPlant:
    """A plant that was found but not yet made."""

    place: str
    """FILE.py:NAME, a name of `VARIANTS` or of an installed plant, or `WORLD` and a scene."""
    sha256: str
    """SHA-256 of the file in hexadecimal; empty for an installed plant."""
    maker: Maker | Variant = field(compare=False)
    """Makes the plant."""

    @property
    def recorded(self) -> RecordedPlant:
        """Reference to the plant for a recording."""
        return RecordedPlant(self.place, self.sha256)

    def make(self, description: RobotDescription, carried: Payload, seed: int = 0) -> Plant:
        """Make the plant for the server's description and carried payload; raise OwnFileError if that fails.

        Only plants of `VARIANTS` use the seed.
        """
        if isinstance(self.maker, Variant):
            try:
                return self.maker.make(description, carried, seed)
            except ValueError as error:
                raise OwnFileError(f"plant {self.place}: {error}") from error
        try:
            made = self.maker(description, carried)
            if is_plant(made):
                return called(made, description.joints)
        except (PlantError, SceneError) as error:  # its message gives the reason
            said = f"{error}" if self.place.startswith(WORLD) else f"plant {self.place}: {error}"
            raise OwnFileError(said) from error
        except (Exception, SystemExit) as error:
            if ends(error):
                raise
            raise OwnFileError(f"plant {self.place}: making it raises {named(error)}") from error
        raise OwnFileError(
            f"plant {self.place}: it makes a {type(made).__name__}, which is no plant: a plant has payload and step"
        )

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickle by name, since a maker cannot be pickled."""
        return load_again, (load_plant, "plant", self.place, self.sha256)


def load_plant(place: str) -> OwnPlant:
    """Find a plant.

    Args:
        place: FILE.py:NAME, where NAME takes a `RobotDescription` and a `Payload` and makes a `Plant`; or a
            name of `VARIANTS` or of an entry point in the group `tvist.plants`.

    Raises:
        OwnFileError: There is none.
        UserFileError: The file is not text, or is larger than 4 MiB.
    """
    if place in VARIANTS:
        return OwnPlant(place, "", VARIANTS[place])
    if place.lower().startswith("ur://"):
        raise OwnFileError(
            f"plant is {place!r}, a real arm, which cannot repeat motions for a replay or a comparison: use it with "
            "tvist serve, or give a simulated plant"
        )
    if place.startswith(WORLD):
        return load_world(place.removeprefix(WORLD))
    if is_file(place):
        _, _, sha256, found = run_file(place, "plant", is_of_file)
    else:
        sha256, found = "", _installed(place)
    if not callable(found):
        raise OwnFileError(
            f"plant {place}: it is of type {type(found).__name__}; it must be a class or a function that makes a plant "
            "from a RobotDescription and a Payload"
        )
    return OwnPlant(place, sha256, found)


def load_world(scene: str) -> OwnPlant:
    """Find the arm in a scene of the package, or in an MJCF file."""
    file = find_scene(scene)

    def make(description: RobotDescription, carried: Payload) -> Plant:
        try:
            from tvist_plant.world.mujoco_arm import MujocoArm
        except ImportError as error:
            raise SceneError(f"world needs MuJoCo: pip install 'tvist[world]' ({error})") from error
        return MujocoArm(description, carried, file)

    return OwnPlant(WORLD + scene, file.sha256, make)


def named_plants() -> list[str]:
    """Return the names of the package's and of installed plants."""
    return [*VARIANTS, *sorted(entry_points(group=GROUP).names)]


def _installed(name: str) -> object:
    for one in entry_points(group=GROUP, name=name):
        try:
            return one.load()
        except (Exception, SystemExit) as error:
            if ends(error):
                raise
            raise OwnFileError(f"plant {name}: loading {one.value} fails: {error}") from error
    raise OwnFileError(f"plant is {name!r}: must be FILE.py:NAME, or one of {', '.join(named_plants())}")
