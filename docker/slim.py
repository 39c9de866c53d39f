"""Take out of an environment what only building, testing and looking need. Run by its own python."""  # noqa: INP001  a script

import filecmp
import shutil
import subprocess
import sys
import sysconfig
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path

SITE = Path(sysconfig.get_path("purelib"))
PREFIX = SITE / "cmeel.prefix"
"""Where the C++ libraries of pinocchio and coal are, with all that a C++ project has."""


def unneeded() -> Iterator[Path]:
    """Folders and files that no import opens."""
    yield Path(sys.prefix) / "include"
    for root in (SITE, PREFIX):
        yield from (root / name for name in ("bin", "share"))
    # `numpy.testing` and the like are modules; `tests` are what they test.
    for name in ("cmake", "include", "pkgconfig", "tests"):
        yield from (path for path in SITE.rglob(name) if path.is_dir())
    for pattern in ("*.a", "*.dae", "*.h", "*.hpp", "*.obj", "*.pyi", "*.pyx", "*.pxd", "*.stl"):
        yield from SITE.rglob(pattern)


def merge_copies() -> None:
    """One file for `liba.so`, `liba.so.1` and `liba.so.1.2`: a wheel cannot hold links and brings copies."""
    same: defaultdict[tuple[Path, str, int], list[Path]] = defaultdict(list)
    for library in SITE.rglob("*.so*"):
        if library.is_file() and not library.is_symlink():
            same[library.parent, library.name.partition(".so")[0], library.stat().st_size].append(library)
    for first, *others in map(sorted, same.values()):
        for other in others:
            if filecmp.cmp(first, other, shallow=False):
                other.unlink()
                other.symlink_to(first.name)


def strip() -> None:
    """Symbols that only a debugger reads go; a third of some libraries."""
    # What wheels have bundled in `*.libs` was rewritten when they were made, and does not survive a second time.
    bundled = set(SITE.glob("*.libs/*"))
    libraries = {path for path in SITE.rglob("*.so*") if path.is_file() and not path.is_symlink()}
    subprocess.run(["strip", "--strip-unneeded", *sorted(libraries - bundled)], check=True)  # noqa: S603, S607  our own files


for path in list(unneeded()):
    if path.is_dir():
        shutil.rmtree(path)
    else:
        path.unlink(missing_ok=True)
merge_copies()
strip()
