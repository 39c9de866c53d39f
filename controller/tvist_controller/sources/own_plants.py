"""Plants that are not part of the package: from a file, given as FILE.py:NAME, or from an installed package."""

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import lru_cache
from importlib.metadata import EntryPoint, entry_points
from typing import Any

from msgspec import Struct

from tvist_controller.sources.own_files import OwnFileError, ends, is_file, run_file
from tvist_controller.sources.plant_calls import called
from tvist_plant.description import Payload, RobotDescription
from tvist_plant.plant import Plant
from tvist_plant.user_file import named

GROUP = "tvist.plants"
"""Group of the entry points by which installed packages offer plants."""
Maker = Callable[[RobotDescription, Payload], Plant]
"""Makes a plant of a robot's description and the payload that it carries."""


class OwnPlantError(OwnFileError):
    """There is no such plant, or it cannot be made; the message says why."""


class RecordedPlant(Struct, frozen=True):
    """Description of a plant, as a recording contains it."""

    place: str
    """FILE.py:NAME, or the name of an installed plant."""
    sha256: str = ""
    """SHA-256 of the file, in hexadecimal; empty if it is installed."""


@dataclass(frozen=True)
class OwnPlant:
    """A plant that was found, and is yet to be made."""

    place: str
    """FILE.py:NAME, or the name of an installed plant."""
    sha256: str
    """SHA-256 of the file that was run, in hexadecimal; empty if it is installed."""
    maker: Maker = field(compare=False)
    """Makes the plant."""

    @property
    def recorded(self) -> RecordedPlant:
        """Description of the plant for a recording."""
        return RecordedPlant(self.place, self.sha256)

    def make(self, description: RobotDescription, carried: Payload) -> Plant:
        """Make the plant for one robot.

        Args:
            description: The robot.
            carried: Payload that the arm carries, as far as the server knows.

        Raises:
            OwnPlantError: Making it fails, or what is made is not a plant.
        """
        try:
            made = self.maker(description, carried)
            if isinstance(made, Plant):
                return called(made, description.joints)
        except (Exception, SystemExit) as error:
            if ends(error):
                raise
            raise OwnPlantError(f"plant {self.place}: making it raises {named(error)}") from error
        raise OwnPlantError(
            f"plant {self.place}: it makes a {type(made).__name__}, which is no plant: that has payload and step"
        )

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickle the plant as its name, since a maker cannot be pickled."""
        return _load_again, (self.place, self.sha256)


def load_plant(place: str) -> OwnPlant:
    """Find a plant.

    Args:
        place: FILE.py:NAME, where NAME is a class or function that takes a `RobotDescription` and a `Payload` and
            makes a `Plant`; or the name of an entry point of the group `tvist.plants`.

    Raises:
        OwnPlantError: There is none.
        UserFileError: The file is not text, or is larger than 4 MiB.
    """
    if is_file(place):
        own = run_file(place, "plant", OwnPlantError, _may_be_one)
        found, sha256 = own.found, own.sha256
    else:
        found, sha256 = _installed(place), ""
    if not callable(found):
        raise OwnPlantError(
            f"plant {place}: it is of type {type(found).__name__}; it must be a class or a function that takes a "
            "RobotDescription and a Payload, and makes a plant"
        )
    return OwnPlant(place, sha256, found)


def installed_plants() -> list[str]:
    """Names of the plants that installed packages offer."""
    return sorted({one.name for one in _offered()})


def _installed(name: str) -> object:
    for one in _offered():
        if one.name == name:
            try:
                return one.load()
            except (Exception, SystemExit) as error:
                if ends(error):
                    raise
                raise OwnPlantError(f"plant {name}: loading {one.value} fails: {error}") from error
    known = ", ".join(installed_plants())
    raise OwnPlantError(
        f"plant is {name!r}: must be FILE.py:NAME, or one of {known or 'those installed: none'}"
    )


def _offered() -> tuple[EntryPoint, ...]:
    return tuple(entry_points(group=GROUP))


def _may_be_one(value: object, *, own: bool) -> bool:
    return own and callable(value)


@lru_cache(maxsize=8)
def _load_again(place: str, sha256: str) -> OwnPlant:
    """Find a plant again in a worker process.

    Raises:
        OwnPlantError: The file has changed since it was first run, or there is no such plant.
    """
    found = load_plant(place)
    if found.sha256 != sha256:
        raise OwnPlantError(f"plant {place}: the file has changed since it was first loaded")
    return found
