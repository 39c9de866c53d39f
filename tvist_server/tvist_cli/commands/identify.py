"""`tvist identify`: calibrate a robot from its own accelerometer."""

import asyncio
from contextlib import AsyncExitStack
from pathlib import Path
from typing import TYPE_CHECKING

from tvist_cli.failure import Failure, told
from tvist_cli.output import err, out, print_json, progress, table

if TYPE_CHECKING:
    from tvist_lab.identification.identify import Identification

PAPER_MASS = 5.0
"""What a served robot carries unless told otherwise [kg]."""


def identify(
    endpoint: str | None = None,
    *,
    output: Path = Path("calibration.json"),
    name: str | None = None,
    robot: str = "ur5e",
    security: Path | None = None,
    payload: float | None = None,
    configurations: int = 160,
    repeats: int = 3,
    seed: int = 0,
    at: list[str] | None = None,
    figures: Path | None = None,
    json: bool = False,
) -> None:
    """Jog the arm all over its workspace, fit what rings, and write a calibration.

    Without an endpoint a robot is made in this process and runs as fast as it computes (about a minute); with one it
    is done over the network, in the robot's own time (about half an hour).

    Args:
        endpoint: Zenoh endpoint of a served robot.
        output: File to write.
        name: Of the calibration; default: the file's.
        robot: Name of the served robot; in process, the robot file.
        security: Folder with this client's certificate, made by tvist keys; the endpoint is then tls/HOST:PORT.
        payload: Mass of the paper's disc in kg, in process.
        configurations: How many, spread over the workspace.
        repeats: Jogs averaged at each.
        seed: Of the spread, and of noise and gear errors in process.
        at: Poses to measure with more weight: names of the robot file or angles with commas [Q1 Q2 Q3].
        figures: Folder for a figure of the fit.
        json: Print one JSON object.
    """
    if configurations < 1 or repeats < 1:
        raise Failure("configurations and repeats must be at least 1", code=2)
    from tvist_client.robot import Robot
    from tvist_lab.identification.fit import FitError
    from tvist_lab.identification.identify import Plan
    from tvist_lab.identification.identify import identify as run
    from tvist_lab.in_process import free_setup, robot_in_process
    from tvist_plant.description import DescriptionError, load
    from tvist_protocol.calibration import calibration_to_json
    from tvist_server.config import ConfigError, from_mapping

    with told(DescriptionError, ConfigError, code=2):
        description = load(robot if endpoint is None else "ur5e")
        anchors = [
            _pose(text, description.poses, description.joints) for text in at or list(description.poses)
        ]
        setup = None
        if endpoint is None:
            content = {
                "robot": robot,
                "payload": payload,
                "calibration": "none",
                "clock": "free",
                "seed": seed,
                "truth": True,
            }
            setup = free_setup(from_mapping(content, "options"))
    plan = Plan(configurations=configurations, anchors=tuple(anchors), repeats=repeats, seed=seed)
    command = f"tvist identify --configurations {configurations} --repeats {repeats} --seed {seed}"
    if payload is not None:
        command += f" --payload {payload:g}"

    async def measure() -> "Identification":
        async with AsyncExitStack() as stack:
            if endpoint is not None:
                client = await stack.enter_async_context(
                    await Robot.connect(endpoint, robot, security=security)
                )
            elif setup is not None:
                client = await stack.enter_async_context(robot_in_process(setup))
            arm = await stack.enter_async_context(client.control("identify"))
            with progress(configurations + len(anchors), "ring-downs") as bar:
                return await run(
                    client, arm, plan, name=name or output.stem, command=command,
                    progress=lambda: bar(1, None),
                )  # fmt: skip

    with told(FitError, OSError):
        done = asyncio.run(measure())
        output.write_bytes(calibration_to_json(done.calibration))
    if figures is not None:
        from tvist_lab.figures import identified_figure, save

        figures.mkdir(parents=True, exist_ok=True)
        drawn = identified_figure(
            done.calibration, done.q, done.f_d, done.zeta, done.true_f_d, done.true_zeta
        )
        err.print(str(save(drawn, figures / "identification.png")))
    _report(done, output, json=json)


def _pose(text: str, poses: dict[str, tuple[float, ...]], joints: int) -> tuple[float, ...]:
    if text in poses:
        return poses[text]
    try:
        angles = tuple(float(angle) for angle in text.split(","))
    except ValueError:
        angles = ()
    if len(angles) != joints:
        raise Failure(
            f"at is {text!r}: must be one of {', '.join(poses)}, or {joints} angles with commas", code=2
        )
    return angles


def _report(done: "Identification", output: Path, *, json: bool) -> None:
    how = done.calibration.provenance
    if json:
        print_json(
            {
                "file": str(output),
                "configurations": how.configurations,
                "ring_downs": how.ring_downs,
                "rejected": how.rejected,
                "f_d_range_hz": how.measured_f_d_range,
                "zeta_range": how.measured_zeta_range,
                "error_f_d_percent": done.error_f_d.median,
                "error_zeta_percent": done.error_zeta.median,
                "error_f_d_p90_percent": done.error_f_d.p90,
                "error_zeta_p90_percent": done.error_zeta.p90,
                "against": done.against,
                "cross_validated_f_d_percent": how.cross_validated_f_d_percent.median,
                "cross_validated_zeta_percent": how.cross_validated_zeta_percent.median,
                "poses": done.poses(),
            }
        )
        return
    low, high = how.measured_f_d_range
    out.print(
        f"{how.configurations} configurations, {how.ring_downs} ring-downs, {how.rejected} configurations rejected; "
        f"f_d spans {low:.1f} to {high:.1f} Hz over the workspace (paper: 6 to 15 Hz)"
    )
    table(
        "deviation of the calibration",
        ("against", "f_d median %", "p90 %", "ζ median %", "p90 %"),
        [
            _row("its own measurements", how.residual_f_d_percent, how.residual_zeta_percent),
            _row(
                "measurements it did not see",
                how.cross_validated_f_d_percent,
                how.cross_validated_zeta_percent,
            ),
            *([_row(done.against, done.error_f_d, done.error_zeta)] if done.true_f_d is not None else []),
        ],
    )
    mass = (
        f" --payload {done.calibration.payload.mass:g}" if done.calibration.payload.mass != PAPER_MASS else ""
    )
    out.print(f"written to {output}; use it with: tvist serve --calibration {output}{mass}")


def _row(against: str, f_d: object, zeta: object) -> tuple[str, ...]:
    return (against, *(f"{getattr(s, k):.1f}" for s in (f_d, zeta) for k in ("median", "p90")))
