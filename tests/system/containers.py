"""Podman with its own storage, a base image made from the distribution, and robots in containers."""

import json
import os
import select
import shutil
import signal
import subprocess
import time
from pathlib import Path

import pytest
from tests.conformance.served import PATIENCE, Served, free_endpoint

ROOT = Path(__file__).parents[2]
TOOLS = {
    "podman": "podman", "runc": "runc", "iptables": "iptables", "mmdebstrap": "mmdebstrap",
    "/usr/lib/podman/netavark": "netavark", "/usr/lib/podman/aardvark-dns": "aardvark-dns",
}  # fmt: skip
"""Programs, and the packages that contain them."""
BASE = (
    "--variant=minbase", "--include=python3,python3-venv,ca-certificates", "--dpkgopt=path-exclude=/usr/share/doc/*",
    "--dpkgopt=path-exclude=/usr/share/man/*", "--dpkgopt=path-exclude=/usr/share/locale/*", "bookworm",
)  # fmt: skip
"""Like `python:3.11-slim-bookworm`: the same Debian and Python, and little else."""
MACHINES_OWN = ("/etc/pip.conf", "/etc/ssl/certs", "/usr/local/share/ca-certificates")
"""Files with this machine's access to package indexes, mounted in a build."""
BUILD_TIME = 600.0


def not_tested(why):
    """Skip with a clear message."""
    pytest.skip(f"CONTAINER NOT TESTED: {why}")


def said(result):
    """Return the end of a program's output."""
    return " ".join((result.stderr or result.stdout).split())[-300:]


def install(*packages):
    """Install packages of the distribution, or skip the test."""
    if os.geteuid() != 0:
        not_tested(f"{', '.join(packages)} missing, and only root may install")
    if shutil.which("apt-get") is None:
        not_tested(f"{', '.join(packages)} missing, and no apt-get here to install with")
    environment = {**os.environ, "DEBIAN_FRONTEND": "noninteractive"}
    for command in (["update"], ["install", "--yes", "--no-install-recommends", *packages]):
        result = subprocess.run(
            ["apt-get", "--quiet", *command],
            capture_output=True, text=True, env=environment, timeout=BUILD_TIME, check=False,
        )  # fmt: skip
        if result.returncode != 0:
            not_tested(f"apt-get cannot install {', '.join(packages)}: {said(result)}")


class Engine:
    """Podman with images, containers and networks in a folder of its own, not in those of the machine."""

    def __init__(self, folder):
        missing = [package for program, package in TOOLS.items() if shutil.which(program) is None]
        if missing:
            install(*missing)
        self.folder = folder
        configuration = {
            # These limits and this runtime also work inside a container or a small machine.
            "containers.conf": (
                '[containers]\ndefault_ulimits = ["nofile=1024:10000", "nproc=4096:4096"]\n'
                '[engine]\nruntime = "runc"\ncgroup_manager = "cgroupfs"\nevents_logger = "file"\n'
                f'[network]\nnetwork_backend = "netavark"\nnetwork_config_dir = "{folder}/networks"\n'
            ),
            "storage.conf": (
                f'[storage]\ndriver = "overlay"\ngraphroot = "{folder}/store"\nrunroot = "{folder}/run"\n'
            ),
        }
        for name, content in configuration.items():
            (folder / name).write_text(content, encoding="utf-8")
        files = {"CONTAINERS_CONF": "containers.conf", "CONTAINERS_STORAGE_CONF": "storage.conf"}
        self.environment = os.environ | {name: str(folder / file) for name, file in files.items()}

    def __call__(self, *command, timeout=PATIENCE, check=True):
        """Run a podman command; return its stdout."""
        return self.run("podman", *command, timeout=timeout, check=check).stdout.strip()

    def run(self, *command, timeout=PATIENCE, check=True, **environment):
        """Run a program that uses podman."""
        result = subprocess.run(
            list(map(str, command)),
            capture_output=True, text=True, timeout=timeout, check=False, env=self.environment | environment,
        )  # fmt: skip
        said = result.stdout[-2000:] + result.stderr[-4000:]
        assert not check or result.returncode == 0, f"{command}: {said}"
        return result

    def base(self, name):
        """Make a base image from packages of the distribution."""
        archive = self.folder / "base.tar"
        result = self.run("mmdebstrap", *BASE, archive, timeout=BUILD_TIME, check=False)
        if result.returncode != 0:
            not_tested(f"mmdebstrap cannot make a base image: {said(result)}")
        self("import", archive, name, timeout=BUILD_TIME)
        archive.unlink()

    def build(self, base, name):
        """Build the image like docker/README.md, on another base."""
        lent = [f"--volume={path}:{path}:ro" for path in MACHINES_OWN if Path(path).exists()]
        self(
            "build", "--format=docker", "--network=host", *lent, f"--build-arg=BASE={base}",
            "--file=docker/Dockerfile", f"--tag={name}", ".", timeout=BUILD_TIME,
        )  # fmt: skip

    def inspect(self, name, kind="container"):
        """Return podman's description of a container or an image."""
        return json.loads(self(kind, "inspect", name))[0]

    def close(self):
        """Stop containers, and remove mounts and networks."""
        self("rm", "--all", "--force", "--time=0")
        self("network", "prune", "--force")
        self("image", "unmount", "--all", "--force", check=False)
        shutil.rmtree(self.folder, ignore_errors=True)


class Contained(Served):
    """A robot in a container with a read-only file system, without capabilities, on a bridge network.

    `options` are those of `podman run`; without a `command`, that of the image is run.
    """

    def __init__(self, engine, *options, command=()):
        self.engine, self.name = engine, f"robot-{time.monotonic_ns()}"
        self.endpoint = free_endpoint()
        port = self.endpoint.rpartition(":")[2]
        words = [
            "podman", "run", f"--name={self.name}", "--health-interval=disable", "--read-only",
            "--read-only-tmpfs=false", "--cap-drop=ALL", "--security-opt=no-new-privileges", "--network=tests",
            f"--publish=127.0.0.1:{port}:7447", *options, "tvist", *command,
        ]  # fmt: skip
        self._begin(subprocess.Popen, words, engine.environment)

    @property
    def pid(self):
        """Return the number of the container's first process on this machine."""
        return self.engine.inspect(self.name)["State"]["Pid"]

    def end(self, number=signal.SIGTERM):
        """Send a signal to the first process, wait for its end, and return the exit code."""
        watch = os.pidfd_open(self.pid)
        try:
            signal.pidfd_send_signal(watch, number)
            ended, _, _ = select.select([watch], [], [], PATIENCE)
        finally:
            os.close(watch)
        assert ended, f"still there {PATIENCE:.0f} s after {signal.Signals(number).name}"
        return self.wait()

    def kill(self):
        """Remove the container and its network."""
        self.engine("rm", "--force", "--ignore", "--time=0", self.name)
        super().kill()
