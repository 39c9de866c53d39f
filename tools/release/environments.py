"""Clean environments that contain the packages just built."""

import os
import re
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

PINNED = re.compile(r"^([\w.-]+==[^ ]+(?: ;[^\\\n]*)?)", re.MULTILINE)


class FailedError(Exception):
    """A program failed, or an environment does not contain what was built."""


def run(*words: str | Path, cwd: Path, env: dict[str, str] | None = None, seconds: float = 1800) -> str:
    """Run a program, which must succeed in time, and return its stdout."""
    out = subprocess.PIPE
    ran = subprocess.run(words, cwd=cwd, env=env, timeout=seconds, stdout=out, text=True, check=False)
    if ran.returncode != 0:
        raise FailedError(f"{words} ended with exit code {ran.returncode}: {ran.stdout}")
    return ran.stdout


def constraints(lock: str) -> str:
    """Return the versions of a lock file as constraints without hashes, since new builds have none."""
    return "".join(f"{pin.strip()}\n" for pin in PINNED.findall(lock))


def clean() -> dict[str, str]:
    """Return this process's environment without variables that name a checkout or a cache of compiled functions."""
    ours = {"PYTHONPATH", "PYTHONHOME", "VIRTUAL_ENV", "NUMBA_CACHE_DIR"}
    return {name: os.environ[name] for name in os.environ.keys() - ours} | {"PYTHONUNBUFFERED": "1"}


def install(what: str, where: Path, dist: Path, versions: Path, python: str) -> None:
    """Create an environment of a Python, and install a requirement in it, with uv if available."""
    run(python, "-m", "venv", "--without-pip", where, cwd=dist)
    uv = shutil.which("uv")
    at: list[str | Path] = ["--python", where / "bin" / "python"]
    pip = [uv, "pip", "install", *at] if uv else [sys.executable, "-m", "pip", *at, "install"]
    run(*pip, "--quiet", "--find-links", dist, "--constraint", versions, what, cwd=dist)
    for wheel in dist.glob("*.whl"):
        check_is_built(wheel, where)


def check_is_built(wheel: Path, where: Path) -> None:
    """Check that an environment has the files of a wheel, if its distribution is installed at all."""
    record = "-".join(wheel.name.split("-")[:2]) + ".dist-info/RECORD"
    for found in where.glob(f"lib/python*/site-packages/{wheel.name.split('-')[0]}-*.dist-info/RECORD"):
        lines = zipfile.ZipFile(wheel).read(record).decode().splitlines()
        files = [line for line in lines if not line.startswith(record)]
        if not set(files) <= set(found.read_text(encoding="utf-8").splitlines()):
            raise FailedError(f"{found.parent.name} is not the one of {wheel.name}")
