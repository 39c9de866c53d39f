"""Files of scenes: those that come with the package, by name, and a user's own, by path."""

from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path

from tvist_plant.user_file import UserFileError, read_bytes

SCENES = Path(__file__).parent / "scenes"
"""Folder of the scenes that come with the package."""


class SceneError(UserFileError):
    """There is no such scene, or no arm can stand in it; the message says why."""


@dataclass(frozen=True)
class SceneFile:
    """A file that was found, and is yet to be understood."""

    name: str
    """Name of a scene that comes with the package, or the path that was given."""
    path: Path
    """Its file."""
    sha256: str
    """SHA-256 of the file, in hexadecimal; of files that it includes nothing is in it."""


def scenes() -> list[str]:
    """Names of the scenes that come with the package."""
    return sorted(file.stem for file in SCENES.glob("*.xml"))


def find_scene(name: str) -> SceneFile:
    """Find a scene.

    Args:
        name: One of `scenes`, or path of a file in MuJoCo's format (MJCF).

    Raises:
        SceneError: There is no such file, or it cannot be read.
        UserFileError: It is not a regular file, or is larger than 4 MiB.
    """
    path = SCENES / f"{name}.xml" if name in scenes() else Path(name)
    try:
        content = read_bytes(path, "world")
    except OSError as error:
        known = ", ".join(scenes())
        raise SceneError(
            f"world is {name!r}: must be one of {known}, or a file in MuJoCo's format ({error.strerror})"
        ) from error
    return SceneFile(name, path.resolve(), sha256(content).hexdigest())
