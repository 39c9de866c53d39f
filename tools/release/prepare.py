"""Prepares a release: versions, changelog, citation, in a clean tree; the commit and the tag are left to a person."""

import subprocess
from pathlib import Path

from tools.release import changelog, citation
from tools.release.versions import ReleaseError, common_version, ordered, write_version


def prepare(root: Path, version: str, date: str) -> None:
    """Write a version into all distributions, and with a date into the changelog and the citation.

    Nothing is written if something is wrong.

    Args:
        root: Folder of the checkout.
        version: Version to release, X.Y.Z, higher than the present one; or that one, if it has never been tagged.
        date: Date of the release, YYYY-MM-DD.

    Raises:
        ReleaseError: The version is not higher, the tree has changes, or the changelog has nothing to release.
    """
    if changes := git(root, "status", "--porcelain"):
        raise ReleaseError(f"the tree has changes, commit them first: {changes.splitlines()[0].strip()}")
    present = common_version(root)
    if ordered(version) < ordered(present) or f"v{version}" in git(root, "tag", "--list").split():
        raise ReleaseError(f"version is {version}; it must be higher than {present}, and not be tagged yet")
    texts = {
        file: change(file.read_text(encoding="utf-8"), version, date)
        for file, change in ((root / changelog.NAME, changelog.dated), (root / citation.NAME, citation.cited))
    }
    write_version(root, version)
    for file, text in texts.items():
        file.write_text(text, encoding="utf-8")


def check(root: Path, tag: str | None = None) -> str:
    """Return the version of a checkout after checking that it is in all places, and is that of a tag.

    Raises:
        ReleaseError: The places differ, or changelog and citation do not have a tagged version with one date.
    """
    version = common_version(root)
    ordered(version)
    if tag is not None:
        if tag != f"v{version}":
            raise ReleaseError(f"tag is {tag}, the distributions have version {version}: expected v{version}")
        changelog.notes(root, version)
    citation.check(root, version, released=tag is not None)
    return version


def git(root: Path, *words: str) -> str:
    """Return what git says in a checkout."""
    ended = subprocess.run(["git", *words], cwd=root, capture_output=True, text=True, check=False)
    if ended.returncode:
        raise ReleaseError(f"git {words[0]}: {ended.stderr.strip()}")
    return ended.stdout
