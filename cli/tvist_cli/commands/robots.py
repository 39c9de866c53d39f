"""`tvist robots`: the arms that there are, what is known of them, and how well their vibration is suppressed."""

from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tvist_cli.failure import Failure, told
from tvist_cli.output import number, out, print_json, progress, table, typed, words
from tvist_cli.studying import check_range, check_seed

if TYPE_CHECKING:
    from tvist_lab.studies.arms.measure import Measured
    from tvist_plant.description import RobotDescription

VARIED = 50.0
"""Largest percentage by which --vary changes stiffness: a spring must not vanish."""


def robots(
    *robot: str,
    measure: bool = False,
    random: int = 100,
    vary: float = 0.0,
    seed: int = 0,
    markdown: Path | None = None,
    json: bool = False,
) -> None:
    """List the arms that come with the package: size, payload, what is measured, what is assumed, and calibrations.

    Args:
        robot: Names of robots that come with the package, or paths of robot files (TOML or URDF), to tell all that is
            known of each [every robot that comes with the package, in a table].
        measure: Let each arm make random moves with its rated payload, unshaped and with the shaper auto, and compare
            its modes with its calibration and its sag with gravity over stiffness. An arm without a calibration is
            identified first.
        random: Number of random moves for each measurement.
        vary: Percentage by which all springs are stiffer and softer in two further measurements, before each of which
            the arm is identified again.
        seed: Seed of moves, identification and gear errors.
        markdown: File to write a page with the tables to.
        json: Print one JSON object.
    """
    from tvist_lab.studies.arms.about import about
    from tvist_plant.description import DescriptionError, load
    from tvist_plant.description import robots as shipped

    check_range("random", random, 1, 10_000)
    check_range("vary", vary, 0.0, VARIED, " %")
    check_seed(seed)
    if vary and not measure:
        raise Failure("vary needs --measure: it changes nothing in a list", code=2)
    with told(DescriptionError):
        arms = {name: load(name) for name in robot or shipped()}
    listed = [about(name, description) for name, description in arms.items()]
    for one in listed if measure else ():
        one["measured"] = _measured(one["name"], arms[one["name"]], one, random, vary, seed)
    if markdown is not None:
        from tvist_lab.studies.arms.page import robots_page

        with told(OSError):
            markdown.write_text(robots_page(listed, typed()), encoding="utf-8")
    if json:
        print_json({"robots": listed})
        return
    _print(listed, in_full=bool(robot))


def _measured(
    name: str, description: "RobotDescription", known: dict[str, Any], moves: int, vary: float, seed: int
) -> list[dict[str, Any]]:
    """Measure an arm as its file describes it, and stiffer and softer; empty if it has too few joints for auto."""
    from tvist_controller.calibrations import load
    from tvist_lab.identification.identify import IdentificationError
    from tvist_lab.studies.arms.measure import ALONE, measure

    if description.joints < ALONE:
        return []
    calibration = next((one for one in map(load, known["calibrations"]) if one.modal is not None), None)
    found: list[Measured] = []
    factors = [1.0, *([1.0 - 0.01 * vary, 1.0 + 0.01 * vary] if vary else [])]
    with told(IdentificationError), progress(len(factors) * moves, f"moves of {name}") as bar:
        for factor in factors:
            own = calibration if factor == 1.0 else None
            found.append(
                measure(
                    description,
                    own,
                    stiffness=factor,
                    moves=moves,
                    seed=seed,
                    progress=lambda n: bar(n, None),
                )
            )
    return [asdict(one) for one in found]


def _print(listed: list[dict[str, Any]], *, in_full: bool) -> None:
    table(
        "arms",
        ("name", "model", "joints", "length m", "payload kg", "springs and drives", "calibrations"),
        [
            (
                one["name"],
                one["model"],
                str(len(one["joints"])),
                number(one["length_m"], 2),
                f"{one['payload_kg']:g}",
                next((kind for kind, told in one["origins"].items() if "drives" in told), "not told"),
                ", ".join(one["calibrations"]) or "–",
            )
            for one in listed
        ],
    )
    for one in listed if in_full else ():
        out.print(one["name"], style="bold", markup=False)
        words(
            {
                f"{key}": f"{kind}: {told}"
                for kind, keys in one["origins"].items()
                for key, told in keys.items()
            }
        )
        table(
            "joints",
            ("joint", "torque N m", "velocity rad/s", "gear stiffness N m/rad"),
            [
                (name, f"{torque:g}", f"{velocity:.3g}", f"{stiffness:g}")
                for name, torque, velocity, stiffness in zip(
                    one["joints"],
                    one["torque_n_m"],
                    one["velocity_rad_s"],
                    one["gear_stiffness_n_m_rad"],
                    strict=True,
                )
            ],
        )
    rows = [(one["name"], found) for one in listed for found in one.get("measured", ())]
    if rows:
        table(
            "measured",
            (
                "name", "springs", "calibration", "f_d off % 1, 2, 3", "moves", "less % median", "p5", "delay ms",
                "sag off %",
            ),
            [
                (
                    name, f"× {found['stiffness']:g}", found["calibration"],
                    ", ".join(number(value, 1) for value in found["f_d_error_percent"]), str(found["counted"]),
                    *(number(found["reduction_percent"][key], 1) for key in ("median", "p5")),
                    number(found["delay_ms"], 0), number(found["sag_error_percent"], 2),
                )
                for name, found in rows
            ],
        )  # fmt: skip
