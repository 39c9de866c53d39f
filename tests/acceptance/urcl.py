"""Run the tests and examples of UR's C++ client library, ur_client_library, against `tvist serve --ur`.

The library is not part of this repository. Get and build it first (it also builds with an installed GoogleTest:
-DFETCHCONTENT_SOURCE_DIR_GOOGLETEST=/usr/src/googletest):

    git clone https://github.com/UniversalRobots/Universal_Robots_Client_Library urcl
    cmake -S urcl -B urcl-build -DBUILDING_TESTS=ON -DINTEGRATION_TESTS=ON
    make -C urcl-build

Then, as root, since the script makes two network namespaces:

    python3 urcl.py urcl urcl-build --tvist .venv/bin/tvist            # the tests, in headless mode and with the URCap
    python3 urcl.py urcl urcl-build --tvist .venv/bin/tvist --examples

The robot is at 192.168.56.101 in one namespace, and the library at 192.168.56.1 in the other. So the library's tests
have a loopback address without a robot, and the robot can connect to the ports 50001 to 50004 of the library's machine.
Some tests fail when a sample is some milliseconds late, so nothing else should run. Each test is run in a process of
its own, as ctest does. What programs print is in urcl-logs/. The exit status is 0 if everything has passed, apart from
the tests with a known reason.
"""

import argparse
import os
import re
import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import NamedTuple

from report import note

ROBOT, CLIENT = "192.168.56.101", "192.168.56.1"
READY_WITHIN = 300.0  # longest time for the server to start [s]
LIMIT = 120.0  # longest time of a test or an example [s]
LOGS = Path("urcl-logs")

HEADLESS = (
    "primary_client_test_headless",
    "dashboard_client_g5_tests",
    "rtde_tests",
    "ur_driver_deprecated_constructor_test",
    "ur_driver_tests_headless",
    "external_control_program_tests_headless",
    "trajectory_streaming_tests_headless",
    "spline_tests_headless",
    "instruction_executor_test_headless",
)
"""Programs of tests that need a robot; `dashboard_client_x_tests` needs one with PolyScope X."""
BOTH = ("ur_driver_tests", "external_control_program_tests", "spline_tests", "instruction_executor_test")
"""Programs that exist twice, with the endings _headless and _urcap, of the same source."""
TAKES_MODE = (*(f"{name}_headless" for name in BOTH), "trajectory_streaming_tests_headless")

_FAKE = "uses the library's own fake server, and fails without a robot, too"
KNOWN = {
    "RTDEClientTest.get_data_package_fake_server": _FAKE,
    "RTDEClientTest.destroy_client_after_server_stops_sending": _FAKE,
    "RTDEClientTest.reconnect_fake_server_background_read": _FAKE,
    "RTDEClientTest.reconnect_fake_server_blocking_read": _FAKE,
    "DashboardClientTestG5.operational_mode": "needs a robot in local control, and this one is in remote control",
    "DashboardClientTestG5.cb3_version": "needs a robot of the CB3 series, and skips itself",
}
"""Tests that do not pass, and why this is not a fault of the robot."""

EXAMPLES = {
    "dashboard_example": (),
    "rtde_client_example": ("10",),
    "primary_pipeline_example": ("10",),
    "primary_pipeline_calibration_example": (),
    "driver_example": (),
    "spline_example": (),
    "freedrive_example": ("10",),
    "force_mode_example": ("10",),
    "script_command_interface_example": ("10", "true"),
    "trajectory_point_interface_example": (),
    "trajectory_streaming_example": (),
    "instruction_executor": (),
    "send_script": (),
    "tool_contact_example": ("10",),
}
"""Examples that end by themselves, and their arguments after the address: mostly how many seconds they take.

`external_fts_through_rtde` waits for keys, and `direct_torque_control_example` needs PolyScope 5.23.
"""


class Result(NamedTuple):
    """Outcome of one test or example."""

    name: str
    outcome: str  # "passed", or another word
    seconds: float


@contextmanager
def machines() -> Iterator[tuple[list[str], list[str]]]:
    """Make two network namespaces that are joined by a pair of interfaces; remove them at the end.

    The values are the commands that run another one on the robot's machine and on the library's.
    """
    pid = os.getpid()
    names = f"robot{pid}", f"client{pid}"
    with ExitStack() as made:
        for name in names:
            _ip("netns", "add", name)
            made.callback(_ip, "netns", "del", name)
            _ip("-n", name, "link", "set", "lo", "up")
        ends = f"ur{pid}r", f"ur{pid}c"
        _ip("link", "add", ends[0], "netns", names[0], "type", "veth", "peer", ends[1], "netns", names[1])
        for name, end, address in zip(names, ends, (ROBOT, CLIENT), strict=True):
            _ip("-n", name, "addr", "add", f"{address}/24", "dev", end)
            _ip("-n", name, "link", "set", end, "up")
        robot, client = (["ip", "netns", "exec", name] for name in names)
        yield robot, client


def _ip(*arguments: str) -> None:
    subprocess.run(["ip", *arguments], check=True)


@contextmanager
def server(at_robot: list[str], tvist: str) -> Iterator[subprocess.Popen[bytes]]:
    """Serve a robot, and stop it at the end."""
    command = [*at_robot, tvist, "serve", "--ur", "--insecure", "--ur-address", ROBOT]
    log = LOGS / "server.txt"
    with log.open("wb") as file, subprocess.Popen(command, stdout=file, stderr=file) as process:
        try:
            latest = time.monotonic() + READY_WITHIN
            while b"listens on" not in log.read_bytes():
                if process.poll() is not None or time.monotonic() > latest:
                    raise SystemExit(f"the server did not start: see {log}")
                time.sleep(0.1)
            yield process
        finally:
            process.terminate()
        if process.poll() not in {None, 0, -15}:
            raise SystemExit(f"the server ended by itself: see {log}")


def tests_of(program: Path) -> list[str]:
    """Return the names of the tests of a program."""
    command = [program, "--gtest_list_tests"]
    listed = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    found, suite = [], ""
    for line in listed.splitlines():
        name = line.partition("#")[0].rstrip()
        if name.startswith("  "):
            found.append(suite + name.strip())
        elif name.endswith("."):
            suite = name
    return found


def test(at_client: list[str], sources: Path, program: Path, name: str, mode: Sequence[str]) -> Result:
    """Run one test."""
    command = [str(program), f"--gtest_filter={name}", "--robot_ip", ROBOT, *mode]
    result, said = run([*at_client, "stdbuf", "-oL", *command], name, sources / "tests", program.name)
    ran = b"[  PASSED  ] 1 test" in said and b"[  SKIPPED ]" not in said
    return result if ran or result.outcome != "passed" else result._replace(outcome="skipped")


def run(command: list[str], name: str, folder: Path, log: str) -> tuple[Result, bytes]:
    """Run a command; return its outcome and what it printed."""
    env = {**os.environ, "ROBOT_MODEL": "ur5e", "URSIM_VERSION": "latest"}
    began, path = time.monotonic(), LOGS / f"{log}.txt"
    with path.open("ab+") as file:
        begin = file.tell()
        try:
            code = subprocess.run(
                command, cwd=folder, env=env, stdin=subprocess.DEVNULL, stdout=file, stderr=file, timeout=LIMIT,
                check=False,
            ).returncode  # fmt: skip
            outcome = "passed" if code == 0 else "failed" if code == 1 else f"exit status {code}"
        except subprocess.TimeoutExpired:
            outcome = "out of time"
        file.seek(begin)
        return Result(name, outcome, time.monotonic() - began), file.read()


def report(title: str, results: Sequence[Result], known: dict[str, str]) -> int:
    """Print the failures; return how many of them have no known reason."""
    failed = [one for one in results if one.outcome != "passed"]
    print(f"{title}: {len(results) - len(failed)} of {len(results)} passed", flush=True)
    for one in failed:
        why = known.get(one.name, "NOT KNOWN")
        print(f"    {one.outcome} after {one.seconds:.1f} s: {one.name}: {why}", flush=True)
    return sum(one.name not in known for one in failed)


def keep(sources: Path, what: str, results: list[Result], why: dict[str, str]) -> None:
    """Keep the results for the page of tested clients."""
    version = re.search(r"<version>(.*)</version>", (sources / "package.xml").read_text())
    assert version is not None
    note(f"ur_client_library: {what}", version[1], {one.name: one.outcome for one in results}, why)


def main() -> None:
    """Run what the arguments name."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("sources", type=Path, help="folder of the library's sources")
    parser.add_argument("build", type=Path, help="folder of the library's build")
    parser.add_argument("--examples", action="store_true", help="run the examples instead of the tests")
    parser.add_argument("--tvist", default="tvist", help="the tvist to run; default: that of the path")
    options = parser.parse_args()
    if os.geteuid() != 0:
        parser.error("run this as root: it makes network namespaces")
    sources, build = options.sources.resolve(), options.build.resolve()
    LOGS.mkdir(exist_ok=True)
    for old in LOGS.glob("*.txt"):
        old.unlink()
    unknown = 0
    with machines() as (at_robot, at_client), server(at_robot, options.tvist):
        if options.examples:
            results: list[Result] = []
            for name, arguments in EXAMPLES.items():
                command = [*at_client, "stdbuf", "-oL", str(build / "examples" / name), ROBOT, *arguments]
                results.append(run(command, name, sources, name)[0])
                unknown += report(name, results[-1:], {})
            keep(sources, "examples", results, {})
        else:
            for name, program, mode in programs(build / "tests"):
                results = [test(at_client, sources, program, one, mode) for one in tests_of(program)]
                unknown += report(name, results, KNOWN)
                keep(sources, name, results, KNOWN)
    sys.exit(1 if unknown else 0)


def programs(folder: Path) -> Iterator[tuple[str, Path, Sequence[str]]]:
    """Yield the title, the path and the mode of each program.

    The library sends its program itself, or the robot's node External Control asks for it.
    """
    for name in HEADLESS:
        yield name, folder / name, ("--headless", "true") if name in TAKES_MODE else ()
    for name in BOTH:
        own = folder / f"{name}_urcap"
        program = own if own.exists() else folder / f"{name}_headless"
        yield f"{name}_urcap", program, ("--headless", "false")


if __name__ == "__main__":
    main()
