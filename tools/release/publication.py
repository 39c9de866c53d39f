"""What a tag of the present version would publish, and where: read from the built files and the workflows."""

import hashlib
import re
from dataclasses import dataclass
from pathlib import Path

from tools.release.changelog import NAME as CHANGELOG

WORKFLOWS = ".github/workflows"
PUSHES = re.compile(r"docker push|podman push|build-push-action")


@dataclass(frozen=True)
class Publication:
    """One thing and its place."""

    what: str
    where: str
    kib: int | None = None
    sha256: str | None = None


def publications(root: Path, version: str, dist: Path, site: Path, image: str) -> list[Publication]:
    """Return what would be published.

    Args:
        root: Folder of the checkout.
        version: The version.
        dist: Folder with the packages.
        site: Folder of the site, which is there if it was built.
        image: Name and tag of the image.
    """
    found = []
    for file in sorted(dist.glob("tvist*")):
        data = file.read_bytes()
        where = "the package index and the release of the repository (release.yml)"
        found.append(Publication(file.name, where, len(data) // 1024, hashlib.sha256(data).hexdigest()))
    said = f"the release of the repository (release.yml), beside the section of {CHANGELOG}"
    found.append(Publication("SHA256SUMS", said))
    pages = list(site.rglob("*.html"))
    size = sum(file.stat().st_size for file in site.rglob("*") if file.is_file()) // 1024
    when = "GitHub Pages, at each push to the main branch (docs.yml)"
    found.append(Publication(f"site of {len(pages)} pages", when, size))
    flows = [
        file for file in sorted((root / WORKFLOWS).glob("*.yml")) if PUSHES.search(file.read_text("utf-8"))
    ]
    registry = ", ".join(f"the registry in {file.name}" for file in flows)
    found.append(
        Publication(f"image {image}", registry or "nowhere: no workflow pushes it, its users build it")
    )
    found.append(Publication(f"tag v{version}", "git, by a person; it starts release.yml"))
    return found
