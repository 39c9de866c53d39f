"""`tvist study map`: maps of the first mode and of a shaper's delay over the workspace."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

from tvist_cli.failure import Failure, told
from tvist_cli.figure_files import AS_USUAL, FigureOptions
from tvist_cli.output import number, out, table
from tvist_cli.shapers_of import calibration_of, of_impulses
from tvist_cli.simulated_arm import masses_of
from tvist_cli.studying import Figures, Places, check_range, give

if TYPE_CHECKING:
    from tvist_lab.studies.workspace_map import WorkspaceMap


def map(  # noqa: A001  the command's name
    *,
    robot: str = "ur5e",
    payload: float | None = None,
    calibration: str | None = None,
    shaper: str = "zv",
    points: int = 41,
    output: Path | None = None,
    figures: Path | None = None,
    look: FigureOptions = AS_USUAL,
    json: bool = False,
) -> None:
    """Map frequency and damping of the lowest mode and a shaper's delay over the workspace, identified against true.

    The map is over the first two joints that change the modes, which for a six-joint arm are shoulder and elbow; the
    other joints are in the middle of the workspace. Configurations in which the arm would touch itself or the floor
    are left out. The truth is that of the simulated arm.

    Args:
        robot: Name of a robot that comes with the package, or path of a robot file.
        payload: Mass of the disc on the flange in kg, both carried and declared [that of the robot file].
        calibration: Name of a calibration that comes with the package, or path of a calibration file; its modal model
            is used if it has one [the one that comes with the package for this robot].
        shaper: Name of a shaper whose delay is mapped, as tvist shapers lists it, or FILE.py:NAME.
        points: Number of angles of each joint.
        output: JSON file to write the maps to.
        figures: Folder to write a figure of each map to.
        look: How to write the figures.
        json: Print one JSON object.
    """
    from tvist_controller.calibrations import default_for
    from tvist_lab.studies.workspace_map import QUANTITIES, MapError, workspace_map
    from tvist_plant.description import DescriptionError, load
    from tvist_shaping import ShapingError

    places = Places(output=output, figures=figures, look=look)
    places.check()
    check_range("points", points, 3, 501)
    with told(DescriptionError, code=2):
        description = load(robot)
    mass = masses_of(None if payload is None else str(payload), description)[0]
    model = description.robot.model
    if (name := calibration or default_for(model)) is None:
        raise Failure(f"the package has no calibration of a {model}: give --calibration FILE", code=2)
    known, chosen = calibration_of(name), of_impulses(shaper)
    with told(MapError, ShapingError, code=2):
        found = workspace_map(description, known, chosen, mass, points)
    words = f"{description.robot.name}, {mass:g} kg, calibration {known.name}, shaper {chosen.name}"
    result: dict[str, Any] = {
        "robot": description.robot.name,
        "payload_kg": mass,
        "calibration": known.name,
        "shaper": chosen.name,
        **found.as_dict(),
    }
    free = points**2 - result["left_out"]
    if not free:
        raise Failure(f"robot {robot} touches itself or the floor in each of the {points**2} configurations")
    places.write(result, draw=lambda: _figures(found, words, look.width or 2))
    title = f"{words}: {free} of {points**2} configurations of {found.names[0]} and {found.names[1]}"

    def say_it(result: dict[str, Any]) -> None:
        columns = ("map", "identified from", "to", "true from", "to", "error % median", "p95", "max")
        table(title, columns, [_row(key, result) for key in QUANTITIES])
        out.print("error: size of the deviation of what is identified from what is true, in percent")

    give(result, say_it, json=json)


def _figures(found: "WorkspaceMap", words: str, columns: int) -> Figures:
    from tvist_lab.figures import workspace_map_figure
    from tvist_lab.studies.workspace_map import QUANTITIES

    return {
        f"map_{name}": workspace_map_figure(found, key, words, columns) for key, name in QUANTITIES.items()
    }


def _row(key: str, result: dict[str, Any]) -> tuple[str, ...]:
    maps, errors = result["maps"][key], result["errors"][key]
    ends = []
    for kind in ("identified", "true"):
        values = [value for row in maps[kind] for value in row if value is not None]
        ends += [number(end(values), 3 if key == "zeta" else 1) for end in (min, max)]
    sizes = (number(errors[name], 1) for name in ("median_percent", "p95_percent", "max_percent"))
    return (key.replace("_hz", " Hz").replace("_ms", " ms"), *ends, *sizes)
