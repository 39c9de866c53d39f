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
        self._paths: dict[Path, str] = {}

    def offer(self, geometry: Geometry) -> list[str]:
        """Offer a robot's meshes; where one is not here or of another kind, none: the page draws the arm itself."""
        found = [Path(mesh.file) for mesh in geometry.meshes]
        if not all(
            file.suffix.lower() in KINDS and file.is_file() and file.stat().st_size <= LARGEST
            for file in found
        ):
            return []
        for file in found:
            # A robot that comes back has its old paths.
            self._paths.setdefault(file, f"/mesh/{len(self._paths)}{file.suffix.lower()}")
        return [self._paths[file] for file in found]

    def content(self, path: str) -> bytes | None:
        """Content of a file that was offered."""
        return next((file.read_bytes() for file, its in self._paths.items() if its == path), None)
