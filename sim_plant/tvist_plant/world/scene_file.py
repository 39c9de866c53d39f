"""Files of scenes: those that come with the package, by name, and a user's own, by path."""

from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path

from tvist_plant.user_file import UserFileError, read_bytes, xml

SCENES = Path(__file__).parent / "scenes"
"""Folder of the scenes that come with the package."""


class SceneError(ValueError):
    """There is no such scene, or no arm can stand in it; the message says why."""


@dataclass(frozen=True)
class SceneFile:
    """A file that was found, and is yet to be understood."""

    name: str
    """Name of a scene that comes with the package, or the path that was given."""
    path: Path
    """Its file."""
    sha256: str
    """SHA-256 of the file, in hexadecimal; it says nothing of files that this one includes."""


def scenes() -> list[str]:
    """Names of the scenes that come with the package."""
    return sorted(file.stem for file in SCENES.glob("*.xml"))


def find_scene(name: str) -> SceneFile:
    """Find a scene.

    Args:
        name: One of `scenes`, or path of a file in MuJoCo's format (MJCF).

    Raises:
        SceneError: There is no such file, or it is none of MuJoCo's.
    """
    path = SCENES / f"{name}.xml" if name in scenes() else Path(name)
    try:
        content = read_bytes(path, "world")
    except OSError as error:
        known = ", ".join(scenes())
        raise SceneError(
            f"world is {name!r}: must be one of {known}, or a file in MuJoCo's format ({error.strerror})"
        ) from error
    except UserFileError as error:
        raise SceneError(str(error)) from error
    try:
        root = xml(content).tag
    except UserFileError as error:
        raise SceneError(f"world {name}: {error}") from error
    if root != "mujoco":
        raise SceneError(
            f"world {name}: it begins with <{root}>: must be a file in MuJoCo's format, <mujoco>"
        )
    return SceneFile(name, path.resolve(), sha256(content).hexdigest())
