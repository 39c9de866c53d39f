"""Run one ur_rtde program on a robot without a shaper and on one with, and draw how their tools shake.

    python 03_ur_rtde_shaping.py [FIGURE]        default: ur-rtde-shaping.png

Needs tvist, and `pip install ur-rtde matplotlib`. It serves both robots itself, on 127.0.0.20, one after the other.
Both carry 5 kg. Everything that is drawn comes from RTDE, as it would from UR's own controller.
"""

import csv
import math
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from matplotlib.figure import Figure
from rtde_control import RTDEControlInterface
from rtde_receive import RTDEReceiveInterface

FIGURE = Path(sys.argv[1] if len(sys.argv) > 1 else "ur-rtde-shaping.png")
HOST, ENDPOINT = "127.0.0.20", "tcp/127.0.0.20:7447"
SHAPERS = {"none": ("without a shaper", "#D55E00"), "zv": ("with the shaper zv", "#0072B2")}
"""Shapers with their labels and colours."""
START, TARGET = "Q1", [1.571, -1.571, 2.618, -1.571, 0.0, 0.0]
GRAVITY = 9.81
FROM, UNTIL = -0.1, 0.3
"""First and last time that the figure shows, counted from the end of the commanded motion [s]."""
LOUD = 0.2
"""Acceleration above which the tool counts as vibrating, more than the sensor's noise [m/s²]."""


def program(control: RTDEControlInterface) -> None:
    """Move to a pose: the program that both robots run."""
    control.moveJ(TARGET, 1.5, 2.0)


@contextmanager
def served(shaper: str) -> Iterator[None]:
    """Serve a robot with a shaper while the block runs."""
    options = ["--ur-address", HOST, "--listen", ENDPOINT, "--profile", "real", "--shaper", shaper]
    with subprocess.Popen(  # noqa: S603  a trusted program
        [sys.executable, "-m", "tvist_cli", "serve", *options, "--start", START],
        stderr=subprocess.PIPE, text=True,
    ) as server:  # fmt: skip
        assert server.stderr is not None
        try:
            said = ""
            while "listens on" not in said:
                said = server.stderr.readline() or sys.exit("the robot did not start")
            yield
        finally:
            server.terminate()


def log(shaper: str, file: Path) -> None:
    """Run the program on a robot with a shaper, and log the robot to a CSV file."""
    with served(shaper):
        control, receive = RTDEControlInterface(HOST), RTDEReceiveInterface(HOST, 500.0)
        names = ["timestamp", "target_qd", "actual_TCP_pose", "actual_tool_accelerometer"]
        receive.startFileRecording(str(file), names)
        program(control)
        until = receive.getTimestamp() + 1.0
        while receive.getTimestamp() < until:
            control.waitPeriod(control.initPeriod())
        receive.stopFileRecording()
        control.stopScript()
        control.disconnect()
        receive.disconnect()


def vibration(file: Path) -> tuple[list[float], list[float]]:
    """Times after the end of the commanded motion [s], and the tool's acceleration without gravity [m/s²]."""
    with file.open(encoding="utf-8", newline="") as lines:
        rows = [{name: float(value) for name, value in row.items()} for row in csv.DictReader(lines)]
    moving = [
        row["timestamp"] for row in rows if any(abs(row[f"target_qd_{joint}"]) > 1e-6 for joint in range(6))
    ]
    times, shaking = [], []
    for row in rows:
        time = row["timestamp"] - moving[-1]
        if FROM <= time <= UNTIL:
            measured = [row[f"actual_tool_accelerometer_{axis}"] for axis in range(3)]
            up = upwards([row[f"actual_TCP_pose_{axis}"] for axis in range(3, 6)])
            times.append(time)
            shaking.append(
                math.hypot(*(one - GRAVITY * other for one, other in zip(measured, up, strict=True)))
            )
    return times, shaking


def upwards(rotation: list[float]) -> list[float]:
    """Return the upward direction in the frame of the tool, whose orientation is a rotation vector."""
    angle = math.hypot(*rotation)
    x, y, z = (one / angle for one in rotation)
    sine, cosine = math.sin(angle), math.cos(angle)
    return [x * z * (1 - cosine) - y * sine, y * z * (1 - cosine) + x * sine, cosine + z * z * (1 - cosine)]


def main() -> None:
    """Log both robots and draw the figure."""
    figure = Figure(figsize=(7.0, 3.2), dpi=150, layout="constrained")
    axes = figure.subplots()
    with tempfile.TemporaryDirectory() as folder:
        for shaper, (label, colour) in SHAPERS.items():
            file = Path(folder) / f"{shaper}.csv"
            log(shaper, file)
            times, shaking = vibration(file)
            still = max(time for time, one in zip(times, shaking, strict=True) if one > LOUD)
            print(
                f"{label}: the tool shook until {1000 * still:.0f} ms after the end of the commanded motion"
            )
            axes.plot(times, shaking, color=colour, label=label, linewidth=1.0)
    axes.axvline(0.0, color="#8A8A8A", linewidth=0.8)
    axes.set(
        xlabel="time after the end of the commanded motion [s]", ylabel="acceleration of the tool [m/s²]"
    )
    axes.set(xlim=(FROM, UNTIL), ylim=(0.0, 2.0))
    axes.legend(frameon=False)
    figure.savefig(FIGURE)


if __name__ == "__main__":
    main()
