"""The machine that figures come from."""

import os
import platform
import sys
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from msgspec import Struct

from tvist_server.punctual import processors

LIBRARIES = ("tvist", "eclipse-zenoh", "mcap", "msgspec", "mujoco", "numba", "numpy", "pin", "ruckig")
"""Distributions whose versions matter for speed."""


class Machine(Struct, frozen=True):
    """What figures depend on besides the program itself."""

    cpu: str
    """Name of the processor."""
    cores: int
    """Number of cores that this process may use."""
    system: str
    """Operating system with its release."""
    python: str
    """Version of Python."""
    libraries: dict[str, str]
    """Versions of the libraries."""
    load: float
    """Number of processes that ran on average in the minute before the start."""


def this_machine() -> Machine:
    """Describe this machine as it is now."""
    return Machine(
        cpu=_processor(),
        cores=processors(),
        system=f"{platform.system()} {platform.release()} {platform.machine()}",
        python=platform.python_version(),
        libraries={name: found for name in LIBRARIES if (found := _version(name)) is not None},
        load=os.getloadavg()[0],
    )


def _processor() -> str:
    if sys.platform == "linux":
        for line in Path("/proc/cpuinfo").read_text(encoding="utf-8", errors="replace").splitlines():
            name, _, value = line.partition(":")
            if name.strip() == "model name":
                return value.strip()
    return platform.processor() or platform.machine()


def _version(distribution: str) -> str | None:
    try:
        return version(distribution)
    except PackageNotFoundError:
        return None
