"""Reading of a recording into columns, compared with the bare MCAP reader, which decodes no message."""

import resource
import statistics
import sys
import tempfile
import time
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import msgspec
from mcap.reader import make_reader

from tvist_controller.api import Setup
from tvist_lab.in_process import free_setup, robot_in_process
from tvist_lab.recordings.export import FORMATS, export
from tvist_lab.recordings.mcap_file import read
from tvist_lab.recordings.read import read as read_any
from tvist_protocol.info import Info
from tvist_protocol.recorded import topics
from tvist_protocol.stream import State, Truth
from tvist_server.recording.writer import RecordingWriter, heading

RATE = 500
"""Number of states in a second."""
SIMULATED = 20 * RATE
"""Number of ticks that are simulated; the recording repeats them with other ticks and times."""
ROUNDS = 5
"""Number of times that each reader reads the file; the medians count."""


async def reading(minutes: float, tell: Callable[[str], None]) -> dict[str, Any]:
    """Record a robot that moves, and read the recording with both readers in turn, each time in a new process.

    Args:
        minutes: Duration of the recording, with truth.
        tell: Called with a description of each step before it starts.

    Returns:
        Numbers of messages and bytes; medians of the times of the bare reader and of ours [s], their ratio, and the
        medians of the processor's time, which other load affects less; the peak memory of the process that reads and
        the size of its columns [bytes]; time to export to each format and to read it back [s], and the size [bytes].
    """
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "run.mcap"
        tell(f"recording {minutes:g} min")
        await _record(path, round(minutes * 60 * RATE))
        bare, ours = [], []
        tell(f"reading it {ROUNDS} times with each reader")
        for _ in range(ROUNDS):
            bare.append(_alone(_read_bare, path))
            ours.append(_alone(_read_columns, path))
        result: dict[str, Any] = {"messages": bare[0]["messages"], "bytes": path.stat().st_size}
        result["bare_s"] = statistics.median(run["seconds"] for run in bare)
        result["columns_s"] = statistics.median(run["seconds"] for run in ours)
        result["ratio"] = result["columns_s"] / result["bare_s"]
        result["bare_cpu_s"] = statistics.median(run["cpu"] for run in bare)
        result["columns_cpu_s"] = statistics.median(run["cpu"] for run in ours)
        result["bare_peak_bytes"] = max(run["peak"] for run in bare)
        result["columns_peak_bytes"] = max(run["peak"] for run in ours)
        result["columns_bytes"] = ours[0]["bytes"]
        for kind in FORMATS:
            tell(f"exporting it to {kind}")
            result[kind] = _alone(_export, path, kind)
    return result


async def _record(path: Path, ticks: int) -> None:
    setup = free_setup()
    states: list[State] = []
    truths: list[Truth] = []
    async with robot_in_process(setup) as robot:
        robot.on_state(states.append)
        robot.on_truth(truths.append)
        info = await robot.info()
        async with robot.control("bench") as arm:
            while len(states) < min(ticks, SIMULATED):
                for name in ("Q2", "Q1"):
                    await arm.move_j(info.poses[name])
                    await robot.pass_time(RATE)
    _write(path, setup, info, list(zip(states, truths, strict=False)), ticks)


def _write(path: Path, setup: Setup, info: Info, run: list[tuple[State, Truth]], ticks: int) -> None:
    with path.open("wb") as stream:
        writer = RecordingWriter(stream, topics(info.name), heading(info, setup.to_builtins()))
        for tick in range(1, ticks + 1):
            for message in run[(tick - 1) % len(run)]:
                writer.write(msgspec.structs.replace(message, tick=tick, timestamp=tick / RATE))
        writer.finish({})


def _alone(function: Callable[..., dict[str, float]], *arguments: object) -> dict[str, float]:
    """Run a function in a process of its own, since the peak memory is that of a process."""
    with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as pool:
        return pool.submit(function, *arguments).result()


def _peak() -> float:
    """Largest memory that this process has had, in bytes; on Linux, unlike getrusage, without that of its parent."""
    if sys.platform != "linux":
        return float(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)
    status = Path("/proc/self/status").read_text()
    return 1024.0 * float(status.partition("VmHWM:")[2].split()[0])


def _read_bare(path: Path) -> dict[str, float]:
    began, worked, messages = time.perf_counter(), time.process_time(), 0
    with path.open("rb") as stream:
        for _ in make_reader(stream).iter_messages():
            messages += 1
    cpu = time.process_time() - worked
    return {"messages": messages, "seconds": time.perf_counter() - began, "cpu": cpu, "peak": _peak()}


def _read_columns(path: Path) -> dict[str, float]:
    began, worked = time.perf_counter(), time.process_time()
    recording = read(path).recording
    seconds, cpu = time.perf_counter() - began, time.process_time() - worked
    arrays = {id(values): values.nbytes for values in recording.columns.values()}
    return {"seconds": seconds, "cpu": cpu, "peak": _peak(), "bytes": sum(arrays.values())}


def _export(path: Path, kind: str) -> dict[str, float]:
    recording, target = read(path).recording, path.with_suffix(f".{kind}")
    began = time.perf_counter()
    export(recording, target, kind)
    written = time.perf_counter()
    again = read_any(target)
    back = time.perf_counter()
    equal = all(again[name].tobytes() == values.tobytes() for name, values in recording.columns.items())
    return {
        "write_s": written - began,
        "read_s": back - written,
        "bytes": target.stat().st_size,
        "equal": float(equal),
    }
