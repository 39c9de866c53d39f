"""The changelog: what is not released gets a version and a date."""

import re
from pathlib import Path

from tools.release.versions import ReleaseError

UNRELEASED = "## [Unreleased]\n"
NAME = "CHANGELOG.md"


def dated(text: str, version: str, date: str) -> str:
    """Return the changelog with its unreleased part under a version and a date, and an empty one above it.

    Raises:
        ReleaseError: Nothing is listed as not released, or the version is there already.
    """
    if heading(version).search(text):
        raise ReleaseError(f"{NAME}: there is already a section about {version}")
    before, mark, after = text.partition(UNRELEASED)
    if not mark or not after.partition("\n## [")[0].strip():
        raise ReleaseError(f"{NAME}: nothing is listed under [Unreleased]")
    return f"{before}{UNRELEASED}\n## [{version}] - {date}\n{after}"


def date_of(root: Path, version: str) -> str:
    """Return the date of a version.

    Raises:
        ReleaseError: There is no dated section about it.
    """
    return _section(root, version)[0]


def notes(root: Path, version: str) -> str:
    """Return what the changelog says about a version.

    Raises:
        ReleaseError: It has no dated section about it.
    """
    return _section(root, version)[1]


def _section(root: Path, version: str) -> tuple[str, str]:
    text = (root / NAME).read_text(encoding="utf-8")
    if not (match := heading(version).search(text)):
        raise ReleaseError(f"{NAME}: there is no section ## [{version}] - YYYY-MM-DD")
    return match["date"], text[match.end() :].partition("\n## [")[0].strip() + "\n"


def heading(version: str) -> re.Pattern[str]:
    """Return what matches the heading of a version's section."""
    return re.compile(rf"^## \[{re.escape(version)}\] - (?P<date>\d{{4}}-\d\d-\d\d)$", re.MULTILINE)
