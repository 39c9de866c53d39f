"""The version, which all distributions share, and the places where it is written."""

import re
import tomllib
from dataclasses import dataclass
from pathlib import Path

VERSION = re.compile(r"(\d+)\.(\d+)\.(\d+)")
OWN = re.compile(r'(?<=version = ")(?P<version>[^"]+)(?=")')
PIN = re.compile(r'"(?P<name>tvist[\w-]*)(?:\[[\w,-]+\])?==(?P<version>[^"; ]+)')
"""A requirement of one distribution for another."""


class ReleaseError(Exception):
    """The repository is not as a release needs it."""


def ordered(version: str) -> tuple[int, int, int]:
    """Return a version's three numbers, which compare as versions do.

    Raises:
        ReleaseError: It is not of the form X.Y.Z.
    """
    if not (match := VERSION.fullmatch(version)):
        raise ReleaseError(f"version is {version!r}, which is not of the form X.Y.Z, such as 1.2.0")
    return int(match[1]), int(match[2]), int(match[3])


@dataclass(frozen=True)
class Distribution:
    """A distribution's pyproject.toml."""

    file: Path
    name: str
    version: str
    pins: tuple[tuple[str, str], ...]
    """Names and versions of the distributions of this project that it needs."""


def distributions(root: Path) -> list[Distribution]:
    """Return the distributions of a checkout: each pyproject.toml there or in a folder of it that has a `project`."""
    found = []
    for file in [root / "pyproject.toml", *sorted(root.glob("*/pyproject.toml"))]:
        text = file.read_text(encoding="utf-8")
        if (project := tomllib.loads(text).get("project")) is not None:
            pins = tuple((match["name"], match["version"]) for match in PIN.finditer(text))
            found.append(Distribution(file, project["name"], project["version"], pins))
    return found


def common_version(root: Path) -> str:
    """Return the version of all distributions.

    Raises:
        ReleaseError: They differ, or one needs another version of another one.
    """
    found = distributions(root)
    version = found[0].version
    for each in found:
        where = each.file.relative_to(root)
        if each.version != version:
            raise ReleaseError(f"{where}: version is {each.version}, that of {found[0].name} is {version}")
        for name, pinned in each.pins:
            if pinned != version:
                raise ReleaseError(f"{where}: needs {name}=={pinned}, the version is {version}")
    return version


def write_version(root: Path, version: str) -> None:
    """Give all distributions a version, also where they need each other."""
    old = common_version(root)
    for each in distributions(root):
        text = each.file.read_text(encoding="utf-8")
        text = OWN.sub(version, text, count=1)
        text = PIN.sub(lambda match: match[0].replace(f"=={old}", f"=={version}"), text)
        each.file.write_text(text, encoding="utf-8")
