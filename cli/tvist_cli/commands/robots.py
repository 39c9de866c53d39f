"""`tvist robots`: list the available arms, or measure how well their vibration is suppressed."""

from typing import TYPE_CHECKING, Annotated, Any

from tvist_cli.failure import Misuse, check_range, failing_on
from tvist_cli.offered import ROBOTS
from tvist_cli.output import out, progress, say, table, words
from tvist_cli.studying import check_seed, print_entries, print_result

if TYPE_CHECKING:
    from tvist_plant.description import RobotDescription

VARIED = 50.0  # largest value of --vary [%]: a spring must not vanish


def robots(
    *robot: Annotated[str, ROBOTS],
    measure: bool = False,
    random: int = 100,
    vary: float = 0.0,
    seed: int = 0,
    json: bool = False,
) -> None:
    """List the arms that come with the package: size, payload, calibrations, and which values are measured or assumed.

    Args:
        robot: Show all that is known about these robots: names that come with the package, or paths of robot
            files (TOML or URDF) [a table of every robot that comes with the package].
        measure: Let each arm make random moves with its own payload, unshaped and with the shaper auto, and
            compare its modes with its calibration, and its sag with gravity divided by stiffness. An arm without a
            calibration is identified first.
        random: Make this number of random moves for each measurement.
        vary: Measure twice more, with all springs stiffer and softer by this percentage; the arm is
            identified again each time.
        seed: Set the seed of moves, identification and gear errors.
        json: Print one JSON object.
    """
    from tvist_lab.studies.arms.about import about
    from tvist_plant.description import DescriptionError, load
    from tvist_plant.description import robots as shipped

    check_range("random", random, 1, 10_000)
    check_range("vary", vary, 0.0, VARIED, " %")
    check_seed(seed)
    if vary and not measure:
        raise Misuse("vary needs --measure: give it, or leave --vary out")
    with failing_on(DescriptionError):
        arms = {name: load(name) for name in robot or shipped()}
    listed = [about(name, description) for name, description in arms.items()]
    for one in listed if measure else ():
        one["measured"] = _measured(one, arms[one["name"]], random, vary, seed)
    print_result({"robots": listed}, lambda: _print(listed, in_full=bool(robot)), json=json)


def _measured(
    known: dict[str, Any], description: "RobotDescription", moves: int, vary: float, seed: int
) -> list[dict[str, Any]]:
    """Measure an arm as described, and stiffer and softer by `vary` [%]; no results for too few joints."""
    from tvist_controller.sources.calibrations import load
    from tvist_lab.identification.ring_downs import IdentificationError
    from tvist_lab.studies.arms.measure import ALONE, measure

    if description.joints < ALONE:
        return []
    calibration = next((one for one in map(load, known["calibrations"]) if one.modal is not None), None)
    factors = [1.0, *([1.0 - 0.01 * vary, 1.0 + 0.01 * vary] if vary else [])]
    found = []
    with progress(len(factors) * moves, f"moves of {known['name']}") as bar:
        for factor in factors:
            own = calibration if factor == 1.0 else None
            try:
                found.append(
                    measure(description, own, stiffness=factor, moves=moves, seed=seed, progress=bar)
                )
            except IdentificationError as error:
                say(f"{known['name']} with springs times {factor:g} is left out: {error}")
    return found


def _print(listed: list[dict[str, Any]], *, in_full: bool) -> None:
    from tvist_lab.studies.arms.about import LISTED, RESULTS

    print_entries("arms", listed, LISTED)
    for one in listed if in_full else ():
        out.print(one["name"], style="bold")
        origins = one["origins"].items()
        words({key: f"{kind}: {text}" for kind, keys in origins for key, text in keys.items()})
        columns = ("joints", "torque_n_m", "velocity_rad_s", "gear_stiffness_n_m_rad")
        table(
            "joints",
            ("joint", "torque N m", "velocity rad/s", "gear stiffness N m/rad"),
            [
                (name, f"{torque:g}", f"{velocity:.3g}", f"{stiffness:g}")
                for name, torque, velocity, stiffness in zip(*(one[key] for key in columns), strict=True)
            ],
        )
    measured = [{"name": one["name"], **found} for one in listed for found in one.get("measured", ())]
    if measured:
        print_entries("measured", measured, RESULTS)
