"""A release rehearsed: everything that a release makes is made and tried, and nothing is published."""

import functools
import json
import re
import shutil
import sys
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass, field
from pathlib import Path

from tools.release.attempt import attempt
from tools.release.environments import FailedError, clean, constraints, install, installed, run
from tools.release.first_commands import First, first_commands
from tools.release.prepare import check
from tools.release.publication import Publication, publications
from tools.release.versions import ReleaseError, common_version

INSTALL_PAGE = "docs/how-to/install.md"
SITE = "build/site/html"
IMAGE_S = 3600.0


@dataclass(frozen=True)
class Row:
    """What was done, and how it ended."""

    what: str
    result: str
    """`ok`, `failed` or `not tried`."""
    seconds: float = 0.0
    why: str = ""


@dataclass
class Rehearsal:
    """A rehearsal of a checkout's release, in a folder that goes away."""

    root: Path
    folder: Path
    rows: list[Row] = field(default_factory=list)
    environments: dict[str, Path] = field(default_factory=dict)
    """Folder of the programs of each environment that could be made."""

    @property
    def tag(self) -> str:
        """Name and tag of the image."""
        return f"tvist:{common_version(self.root)}"

    @property
    def dist(self) -> Path:
        """Folder of the packages."""
        return self.folder / "dist"

    def go(self) -> None:
        """Do all steps; one that fails hinders only those that need it."""
        self.step("version", lambda: check(self.root))
        self.step("packages", lambda: run("make", "dist", f"DIST={self.dist}", cwd=self.root))
        versions = self.folder / "constraints.txt"
        versions.write_text(constraints((self.root / "requirements.lock").read_text("utf-8")), "utf-8")
        for what in installed((self.root / INSTALL_PAGE).read_text(encoding="utf-8")):
            where = self.folder / "environments" / re.sub(r"\W+", "-", what).strip("-")
            if self.step(f"install {what}", functools.partial(install, what, where, self.dist, versions)):
                self.environments[what] = where / "bin"
        commands, silent = first_commands(self.root)
        for number, first in enumerate(commands):
            self.try_first(first, self.folder / f"page-{number}")
        self.add(Row(f"{len(silent)} more pages", "not tried", why="show no command"))
        self.step("site", lambda: run("make", "docs", cwd=self.root))
        self.image()

    def try_first(self, first: First, folder: Path) -> None:
        """Try the first command of a page, unless the table says why not."""
        what = f"{first.page}: {first.command}"
        if first.skip:
            self.add(Row(what, "not tried", why=first.skip))
            return
        folder.mkdir()
        self.step(what, lambda: attempt(first, self.root, folder, self.programs, clean()))

    def programs(self, what: str) -> Path:
        """Return the folder of the programs of an environment."""
        if what not in self.environments:
            raise FailedError(f"there is no environment with {what}")
        return self.environments[what]

    def image(self) -> None:
        """Build the image by the first program that is here and works."""
        why = "not built: no docker, podman or buildah"
        for program in ("docker", "podman", "buildah"):
            if not shutil.which(program):
                continue
            try:
                run(program, "info", cwd=self.root)
            except FailedError:
                why = f"not built: {program} is here, but does not work; no other builder is"
                continue
            build = (program, "build", "--file", "docker/Dockerfile", "--tag", self.tag, ".")
            self.step(f"image {self.tag}", functools.partial(run, *build, cwd=self.root, seconds=IMAGE_S))
            return
        self.add(Row(f"image {self.tag}", "not tried", why=why))

    def step(self, what: str, do: Callable[[], object]) -> bool:
        """Do something, and keep how it ended and how long it took; return whether it went well."""
        print(f"{what} ...", file=sys.stderr, flush=True)
        began = time.monotonic()
        try:
            do()
        except (FailedError, ReleaseError) as error:
            self.add(Row(what, "failed", time.monotonic() - began, str(error).strip()))
            return False
        self.add(Row(what, "ok", time.monotonic() - began))
        return True

    def add(self, row: Row) -> None:
        """Keep a row, and tell it."""
        self.rows.append(row)
        print(f"  {row.result}, {row.seconds:.1f} s. {row.why}".rstrip(), file=sys.stderr, flush=True)

    def published(self) -> list[Publication]:
        """Return what would be published where."""
        return publications(self.root, common_version(self.root), self.dist, self.root / SITE, self.tag)


def rehearse(root: Path, folder: Path, *, as_json: bool) -> bool:
    """Rehearse a release, print what was done and what would be published where; return whether all went well."""
    rehearsal = Rehearsal(root, folder)
    rehearsal.go()
    rows, published = rehearsal.rows, rehearsal.published()
    well = all(row.result != "failed" for row in rows)
    if as_json:
        done, listed = [asdict(row) for row in rows], [asdict(each) for each in published]
        print(json.dumps({"ok": well, "steps": done, "would_publish": listed}, indent=1))
    else:
        print(told(rows, published))
    return well


def told(rows: list[Row], published: list[Publication]) -> str:
    """Return the tables as text: what was done, and what would be published."""
    lines = []
    for row in rows:
        why = f"  ({row.why.splitlines()[-1]})" if row.why else ""
        lines.append(f"{row.result:9} {row.seconds:7.1f} s  {row.what}{why}")
    lines += ["", "would be published:"]
    for each in published:
        size = "" if each.kib is None else f", {each.kib} KiB"
        digest = "" if each.sha256 is None else f"\n  sha256 {each.sha256}"
        lines.append(f"{each.what}{size}: {each.where}{digest}")
    return "\n".join(lines)
