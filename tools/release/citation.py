"""The file that says how to cite the project: it names the version, and the date of a released one."""

import re
from pathlib import Path

from tools.release import changelog
from tools.release.versions import ReleaseError

NAME = "CITATION.cff"
VERSION = re.compile(r"^version: (.+)$", re.MULTILINE)
DATE = re.compile(r"^date-released: (.+)\n", re.MULTILINE)


def cited(text: str, version: str, date: str) -> str:
    """Return the file with a version and the date of its release.

    Raises:
        ReleaseError: It has no version.
    """
    if not VERSION.search(text):
        raise ReleaseError(f"{NAME}: there is no line version: X.Y.Z")
    return VERSION.sub(f"version: {version}\ndate-released: {date}", DATE.sub("", text))


def check(root: Path, version: str, *, released: bool) -> None:
    """Check that it names a version; and, of a released one, the date that the changelog has.

    Raises:
        ReleaseError: It does not.
    """
    text = (root / NAME).read_text(encoding="utf-8")
    named, date = VERSION.search(text), DATE.search(text)
    if named is None or named[1] != version:
        raise ReleaseError(f"{NAME}: version is {named and named[1]}, that of the distributions is {version}")
    if released and (date is None or date[1] != changelog.date_of(root, version)):
        raise ReleaseError(f"{NAME}: date-released is {date and date[1]}, the changelog has another date")
