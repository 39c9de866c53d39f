"""Mesh files on this machine that a robot's geometry names, offered to the page."""

from pathlib import Path

from tvist_protocol.geometry import Geometry

KINDS = (".stl", ".obj", ".dae")  # Suffixes of mesh files that the page can draw
LARGEST = 64 * 2**20  # largest mesh file that is offered [byte]


class Meshes:
    """The files, each with a path on the page's server."""

    def __init__(self) -> None:
        self._paths: dict[Path, str] = {}

    def offer(self, geometry: Geometry) -> list[str]:
        """Return paths of a robot's meshes; none if any is missing or unsuitable, and the page draws the arm itself."""
        found = [Path(mesh.file) for mesh in geometry.meshes]
        if not all(
            file.suffix.lower() in KINDS and file.is_file() and file.stat().st_size <= LARGEST
            for file in found
        ):
            return []
        for file in found:
            # A robot that reconnects keeps its paths.
            self._paths.setdefault(file, f"/mesh/{len(self._paths)}{file.suffix.lower()}")
        return [self._paths[file] for file in found]

    def content(self, path: str) -> bytes | None:
        """Return the content of an offered file; None for another path."""
        return next((file.read_bytes() for file, its in self._paths.items() if its == path), None)
