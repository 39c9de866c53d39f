"""Files of meshes that a robot on this machine names, offered to the page."""

from pathlib import Path

from tvist_protocol.geometry import Geometry

KINDS = (".stl", ".obj", ".dae")
"""Suffixes of meshes that the page can draw."""
LARGEST = 64 * 2**20
"""Largest mesh that is offered [byte]."""


class Meshes:
    """The files, each at a path of the page."""

    def __init__(self) -> None:
        self._files: dict[str, Path] = {}

    def offer(self, geometry: Geometry) -> list[str]:
        """Offer a robot's meshes; where one is not here or of another kind, none: the page draws the arm itself."""
        found = [Path(mesh.file) for mesh in geometry.meshes]
        if not all(
            file.suffix.lower() in KINDS and file.is_file() and file.stat().st_size <= LARGEST
            for file in found
        ):
            return []
        paths = [
            f"/mesh/{len(self._files) + number}{file.suffix.lower()}" for number, file in enumerate(found)
        ]
        self._files.update(zip(paths, found, strict=True))
        return paths

    def content(self, path: str) -> bytes | None:
        """Content of a file that was offered."""
        file = self._files.get(path)
        return None if file is None else file.read_bytes()
