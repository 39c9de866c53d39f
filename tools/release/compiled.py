"""Add wheels of `tvist-compiled` to built packages.

Each holds the kernels of a served robot as machine code for one Python and one architecture. They run on any
processor of the architecture, but only with the versions of numba and llvmlite that the wheel requires.
"""

import argparse
import base64
import hashlib
import json
import platform
import tempfile
import zipfile
from pathlib import Path

from tools.release.environments import FailedError, clean, constraints, install, run

ROOT = Path(__file__).parents[2]

NAME, FOLDER = "tvist-compiled", "tvist_compiled"
SYSTEM = "manylinux_2_17"  # the machine code calls no system library that is not already in the process
ASKED = """
import json, sys
from importlib.metadata import version
tag = "cp{}{}".format(*sys.version_info)
print(json.dumps([tag, *map(version, ("tvist", "numba", "llvmlite"))]))
"""
ABOUT = """Metadata-Version: 2.1
Name: {NAME}
Version: {version}
Summary: What a robot of tvist computes, compiled for any {machine} processor: its first start compiles nothing
License: Apache-2.0
Requires-Dist: tvist[server]=={version}
Requires-Dist: numba=={numba}
Requires-Dist: llvmlite=={llvmlite}
"""


def compiled_wheel(dist: Path, python: str) -> Path:
    """Compile with the packages of a folder, and write the wheel into it; return its path."""
    with tempfile.TemporaryDirectory(prefix="tvist-compiled-") as folder:
        versions, where, kernels = (
            Path(folder) / name for name in ("constraints.txt", "environment", "kernels")
        )
        versions.write_text(constraints((ROOT / "requirements.lock").read_text("utf-8")), "utf-8")
        install("tvist[server]", where, dist, versions, python)
        processor = {"NUMBA_CPU_NAME": "generic", "NUMBA_CPU_FEATURES": "", "NUMBA_CACHE_DIR": str(kernels)}
        run(where / "bin" / "tvist", "serve", "--compile", cwd=where, env=clean() | processor)
        tag, *numbers = json.loads(run(where / "bin" / "python", "-c", ASKED, cwd=where))
        files = {file.name: file.read_bytes() for file in sorted(kernels.rglob("*.kernel"))}
    if not files:
        raise FailedError(f"nothing is compiled by {python}")
    return written(dist, files, tag, *numbers)


def written(dist: Path, kernels: dict[str, bytes], tag: str, version: str, numba: str, llvmlite: str) -> Path:
    """Write a wheel with kernels, given by file name, into a folder; return its path.

    `tag` is the wheel tag of the Python; the versions are those of the packages that compiled the kernels.
    """
    machine = platform.machine()
    tags = f"{tag}-{tag}-{SYSTEM}_{machine}"
    info = f"{FOLDER}-{version}.dist-info"
    about = ABOUT.format(NAME=NAME, version=version, machine=machine, numba=numba, llvmlite=llvmlite)
    made = f"Wheel-Version: 1.0\nGenerator: tvist\nRoot-Is-Purelib: false\nTag: {tags}\n"
    content = {
        f"{FOLDER}/__init__.py": b'"""Machine code of kernels; `tvist_kernels.cache` reads it."""\n',
        **{f"{FOLDER}/{name}": code for name, code in kernels.items()},
        f"{info}/METADATA": about.encode(),
        f"{info}/WHEEL": made.encode(),
    }
    record = "".join(f"{name},{_digest(data)},{len(data)}\n" for name, data in content.items())
    content[f"{info}/RECORD"] = f"{record}{info}/RECORD,,\n".encode()
    wheel = dist / f"{FOLDER}-{version}-{tags}.whl"
    with zipfile.ZipFile(wheel, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, data in content.items():
            archive.writestr(name, data)
    return wheel


def _digest(data: bytes) -> str:
    return "sha256=" + base64.urlsafe_b64encode(hashlib.sha256(data).digest()).decode().rstrip("=")


def main() -> None:
    """Make a wheel for each Python that the command line names."""
    parser = argparse.ArgumentParser(prog="python -m tools.release.compiled", description=__doc__)
    parser.add_argument("dist", type=Path, help="Folder of the built packages, which gets the wheels.")
    parser.add_argument("pythons", nargs="+", help="Programs of Python, such as python3.12.")
    given = parser.parse_args()
    for python in given.pythons:
        wheel = compiled_wheel(given.dist.resolve(), python)
        print(f"{wheel.name}: {wheel.stat().st_size / 1e6:.1f} MB", flush=True)


if __name__ == "__main__":
    main()
