"""Scene files: those of the package by name, a user's own by path."""

from dataclasses import dataclass
from hashlib import file_digest, sha256
from pathlib import Path
from xml.etree.ElementTree import Element

from tvist_plant.user_file import LARGEST, UserFileError, check_is_file, one_line, read_bytes, xml

SCENES = Path(__file__).parent / "scenes"

LARGEST_FILES, MOST_PLACES = 256 << 20, 20_000
"""Largest total size of the files that a scene names [byte], and largest number of paths searched for them."""


class SceneError(ValueError):
    """There is no such scene, or no arm can stand in it; the message states the reason."""


@dataclass(frozen=True)
class SceneFile:
    """A scene file that was found but not yet parsed."""

    name: str  # name of a scene of the package, or the given path
    path: Path  # path of the file
    sha256: str  # SHA-256 of the file in hexadecimal; if it names other files, of all their hashes


def scenes() -> list[str]:
    """Return the names of the package's scenes."""
    return sorted(file.stem for file in SCENES.glob("*.xml"))


def find_scene(name: str) -> SceneFile:
    """Find a scene of the package, or the path of an MJCF file; raise SceneError."""
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
        root = xml(content)
        others = []
        for file in _named(root, path.parent):
            with file.open("rb") as stream:
                others.append(file_digest(stream, "sha256").hexdigest())
    except (UserFileError, OSError) as error:
        raise SceneError(f"world {name}: {one_line(str(error))}") from error
    if root.tag != "mujoco":
        raise SceneError(
            f"world {name}: it begins with <{root.tag}>: must be a file in MuJoCo's format, <mujoco>"
        )
    own = sha256(content).hexdigest()
    whole = sha256("".join((own, *others)).encode()).hexdigest() if others else own
    return SceneFile(name, path.resolve(), whole)


def _named(root: Element, folder: Path) -> list[Path]:
    """Return the existing files that a scene and its included files name; MuJoCo reports missing ones."""
    folders, names, elements, included = {folder}, set[str](), list(root.iter()), 0
    for one in elements:  # the list grows with each included file
        for key, value in one.items():
            if one.tag == "compiler" and key.endswith("dir"):
                folders.add(folder / value)
            elif key.startswith("file") and value not in names:
                names.update((value, Path(value).name))  # `strippath` leaves the name only
                if one.tag in {"include", "model"} and (folder / value).is_file():
                    folders.add((folder / value).parent)
                    content = read_bytes(folder / value, "included file")
                    included += len(content)
                    elements += xml(content).iter()
        if included > LARGEST or len(folders) * len(names) > MOST_PLACES:
            raise UserFileError(
                f"it names too many files: at most {MOST_PLACES}, and {LARGEST >> 20} MiB included"
            )
    places = sorted({place / name for place in folders for name in names})
    for place in (found := [place for place in places if place.exists() and not place.is_dir()]):
        check_is_file(place, "file")
    if sum(place.stat().st_size for place in found) > LARGEST_FILES:
        raise UserFileError(f"the files that it names have more than {LARGEST_FILES >> 20} MiB")
    return found
