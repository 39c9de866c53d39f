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
Runs at the same time do not use each other's ports, but they share the processors, and some tests fail when a sample is
some milliseconds late. Each test is run in a process of its own, as ctest does. The exit status is 0 if everything has
passed, apart from the tests with a known reason.
"""

import argparse
import os
import re
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import NamedTuple

from report import note

ROBOT, CLIENT = "192.168.56.101", "192.168.56.1"
READY_WITHIN = 300.0
"""Longest time for the server to start [s]."""
OUT_OF_TIME = "out of time"

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
BOTH = (
    "ur_driver_tests",
    "external_control_program_tests",
    "spline_tests",
    "instruction_executor_test",
)
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
    """What came of one test or example."""

    name: str
    outcome: str
    """"passed", or another word."""
    seconds: float


class Namespaces(NamedTuple):
    """Names of the two network namespaces."""

    robot: str
    client: str

    def at_robot(self, *command: str) -> list[str]:
        """Return a command that runs another one on the robot's machine."""
        return ["ip", "netns", "exec", self.robot, *command]

    def at_client(self, *command: str) -> list[str]:
        """Return a command that runs another one on the library's machine."""
        return ["ip", "netns", "exec", self.client, *command]


@contextmanager
def namespaces() -> Iterator[Namespaces]:
    """Make two network namespaces that are joined by a pair of interfaces; remove them at the end."""
    pid = os.getpid()
    names = Namespaces(f"robot{pid}", f"client{pid}")
    with ExitStack() as made:
        for name in names:
            _ip("netns", "add", name)
            made.callback(_ip, "netns", "del", name)
            _ip("-n", name, "link", "set", "lo", "up")
        ends = f"ur{pid}r", f"ur{pid}c"
        peer = "type", "veth", "peer", ends[1], "netns", names.client
        _ip("link", "add", ends[0], "netns", names.robot, *peer)
        for name, end, address in zip(names, ends, (ROBOT, CLIENT), strict=True):
            _ip("-n", name, "addr", "add", f"{address}/24", "dev", end)
            _ip("-n", name, "link", "set", end, "up")
        yield names


def _ip(*arguments: str) -> None:
    subprocess.run(["ip", *arguments], check=True)


@contextmanager
def server(
    names: Namespaces, tvist: str, options: Sequence[str], log: Path
) -> Iterator[subprocess.Popen[bytes]]:
    """Serve a robot, and stop it at the end; what it says goes to a file."""
    command = names.at_robot(tvist, "serve", "--ur", "--insecure", "--ur-address", ROBOT, *options)
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


class Library:
    """The built library; a test or an example may take `limit` seconds."""

    def __init__(self, sources: Path, build: Path, logs: Path, names: Namespaces, limit: float) -> None:
        self._sources, self._build, self._logs = sources, build, logs
        self._names, self._limit = names, limit

    def tests(self, program: str, wanted: str) -> list[str]:
        """Return the names of the tests of a program that match a filter of GoogleTest."""
        command = [str(self._program(program)), "--gtest_list_tests", f"--gtest_filter={wanted}"]
        listed = subprocess.run(command, capture_output=True, text=True, check=True).stdout
        found, suite = [], ""
        for line in listed.splitlines():
            name = line.partition("#")[0].rstrip()
            if name.startswith("  "):
                found.append(suite + name.strip())
            elif name.endswith("."):
                suite = name
        return found

    def test(self, program: str, name: str) -> Result:
        """Run one test."""
        command = [str(self._program(program)), f"--gtest_filter={name}", "--robot_ip", ROBOT]
        if program.endswith("_urcap"):
            command += ["--headless", "false"]
        elif program in TAKES_MODE:
            command += ["--headless", "true"]
        log = self._logs / f"{program}.txt"
        before = log.stat().st_size if log.exists() else 0
        result = self._run(name, command, self._sources / "tests", log)
        if result.outcome == "passed":
            with log.open("rb") as file:
                file.seek(before)
                said = file.read()
            if b"[  SKIPPED ]" in said or b"[  PASSED  ] 1 test" not in said:
                return result._replace(outcome="skipped")
        return result

    def example(self, name: str) -> Result:
        """Run one example."""
        command = [str(self._build / "examples" / name), ROBOT, *EXAMPLES[name]]
        return self._run(name, command, self._sources, self._logs / f"{name}.txt")

    def _program(self, name: str) -> Path:
        folder = self._build / "tests"
        if name.endswith("_urcap") and not (folder / name).exists():
            name = name.removesuffix("_urcap") + "_headless"
        return folder / name

    def _run(self, name: str, command: list[str], folder: Path, log: Path) -> Result:
        env = {**os.environ, "ROBOT_MODEL": "ur5e", "URSIM_VERSION": "latest"}
        began = time.monotonic()
        with log.open("ab") as file:
            process = subprocess.Popen(
                self._names.at_client("stdbuf", "-oL", *command),
                cwd=folder,
                env=env,
                stdin=subprocess.DEVNULL,
                stdout=file,
                stderr=file,
            )
            try:
                code = process.wait(self._limit)
                outcome = "passed" if code == 0 else "failed" if code == 1 else f"exit status {code}"
            except subprocess.TimeoutExpired:
                outcome = OUT_OF_TIME
            finally:
                process.kill()
                process.wait()
        return Result(name, outcome, time.monotonic() - began)


def report(title: str, results: Sequence[Result], known: dict[str, str]) -> int:
    """Print a row for a program, and a line for each that has not passed; return how many have no known reason."""
    count = Counter(one.outcome for one in results)
    others = ", ".join(f"{number} {outcome}" for outcome, number in count.items() if outcome != "passed")
    seconds = sum(one.seconds for one in results)
    print(f"| {title} | {len(results)} | {count['passed']} | {others or '-'} | {seconds:.0f} |", flush=True)
    unknown = 0
    for one in results:
        if one.outcome != "passed":
            unknown += one.name not in known
            why = known.get(one.name, "NOT KNOWN")
            print(f"    {one.outcome} after {one.seconds:.1f} s: {one.name}: {why}", flush=True)
    return unknown


def _note(options: argparse.Namespace, what: str, results: list[Result], why: dict[str, str]) -> None:
    """Keep the results of whole programs for the page of tested clients."""
    if options.filter == "*" and not (options.examples and options.only):
        version = re.search(r"<version>(.*)</version>", (options.sources / "package.xml").read_text())
        assert version is not None
        note(f"ur_client_library: {what}", version[1], {one.name: one.outcome for one in results}, why)


def main() -> None:
    """Run what the arguments name."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("sources", type=Path, help="folder of the library's sources")
    parser.add_argument("build", type=Path, help="folder of the library's build")
    parser.add_argument("only", nargs="*", help="programs to run; all by default")
    parser.add_argument("--examples", action="store_true", help="run the examples instead of the tests")
    parser.add_argument(
        "--mode", choices=("headless", "urcap", "both"), default="both",
        help="whether the library sends its program itself, or the robot's node External Control asks for it; "
        "default: both, one after the other",
    )  # fmt: skip
    parser.add_argument("--filter", default="*", help="run only tests that match this filter of GoogleTest")
    parser.add_argument("--limit", type=float, default=120.0, help="longest time of a test [s]; default: 120")
    parser.add_argument("--tvist", default="tvist", help="the tvist to run; default: that of the path")
    parser.add_argument("--serve", default="", help='more options of tvist serve, for example "--shaper zv"')
    parser.add_argument("--logs", type=Path, default=Path("urcl-logs"), help="folder for what programs print")
    options = parser.parse_intermixed_args()
    if os.geteuid() != 0:
        parser.error("run this as root: it makes network namespaces")
    programs = {
        "headless": HEADLESS,
        "urcap": tuple(f"{name}_urcap" for name in BOTH),
        "both": (*HEADLESS, *(f"{name}_urcap" for name in BOTH)),
    }[options.mode]
    available = tuple(EXAMPLES) if options.examples else programs
    chosen = [name for name in available if name in (options.only or available)]
    if missing := set(options.only) - set(chosen):
        parser.error(f"there is no {', '.join(sorted(missing))}; there are {', '.join(available)}")
    options.logs.mkdir(parents=True, exist_ok=True)
    for name in ("server", *available):  # what this script has written before, and nothing else
        (options.logs / f"{name}.txt").unlink(missing_ok=True)
    log = options.logs / "server.txt"
    unknown = 0
    with namespaces() as names, server(names, options.tvist, options.serve.split(), log) as served:
        library = Library(
            options.sources.resolve(), options.build.resolve(), options.logs, names, options.limit
        )
        results: list[Result] = []
        print("| program | tests | passed | others | seconds |\n|---|---:|---:|---|---:|", flush=True)
        if options.examples:
            for name in chosen:
                results.append(library.example(name))
                unknown += report(name, results[-1:], {})
            _note(options, "examples", results, {})
        else:
            for program in chosen:
                tests = library.tests(program, options.filter)
                results = [library.test(program, test) for test in tests]
                unknown += report(program, results, KNOWN)
                _note(options, program, results, KNOWN)
        if served.poll() is not None:
            raise SystemExit(f"the server ended by itself: see {log}")
    sys.exit(1 if unknown else 0)


if __name__ == "__main__":
    main()
