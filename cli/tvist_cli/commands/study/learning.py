"""`tvist study learning`: make each move several times, and see what a robot that learns its motions leaves."""

from typing import Annotated, Any

from cyclopts import Parameter

from tvist_cli.failure import told
from tvist_cli.output import words
from tvist_cli.shapers_of import modal_for
from tvist_cli.studying import check_range, check_seed, command, gathered, give, show

TERMS = {
    "first, 1, 2 ...": "reduction of the largest true acceleration of the tool later than 10 ms after the stop, in the "
    "first motion and in each repetition: median and 5th percentile [%]",
    "worse": "moves whose last repetition leaves over 0.01 m/s² more than the first motion did",
}


def learning(
    *,
    moves: int = 20,
    repetitions: int = 6,
    plants: Annotated[list[str] | None, Parameter(consume_multiple=True)] = None,
    shaper: str = "elastic",
    robot: str = "ur5e",
    calibration: str | None = None,
    seed: int = 0,
    json: bool = False,
) -> None:
    """Repeat random moves on plants that differ from what the controller knows, and learn each of them.

    The payload is up to the robot's rating, and declared.

    Args:
        moves: Number of moves of each plant; those that hardly ring unshaped are left out.
        repetitions: Number of times that each is made again.
        plants: Names of plants, or hidden-SEED [stribeck springs-30 springs+30 torsion base combined].
        shaper: Name of the shaper.
        robot: Name of a robot that comes with the package, or path of a robot file.
        calibration: Name of a calibration that comes with the package, or path of a calibration file; it needs a modal
            model [that of the robot].
        seed: Seed of moves, payloads, deviations and noise.
        json: Print one JSON object.
    """
    from tvist_lab.studies.learning import PLANTS, LearningJob, learnt, report
    from tvist_lab.study.case import arm_seed
    from tvist_lab.study.moves import draw_moves
    from tvist_plant.variants import variant
    from tvist_shaping.errors import ShapingError
    from tvist_shaping.named import BUILT_IN

    check_range("moves", moves, 1, 10_000)
    check_range("repetitions", repetitions, 1, 1000)
    check_seed(seed)
    with told(ShapingError, ValueError, code=2):
        BUILT_IN.check(shaper := shaper.lower())
        chosen = [variant(name.lower()) for name in plants or PLANTS]
    description, known = modal_for(calibration, robot)
    drawn = draw_moves(description, moves, seed, (0.0, description.limits.payload)).moves
    jobs = [
        LearningJob(description, known, shaper, one, move, arm_seed(seed, place), repetitions)
        for one in chosen
        for place, move in enumerate(drawn)
    ]
    done = gathered(learnt(jobs), len(jobs), "moves")
    options = {"moves": moves, "repetitions": repetitions, "plants": plants, "shaper": shaper, "seed": seed}
    options |= {"robot": None if robot == "ur5e" else robot, "calibration": calibration}
    result: dict[str, Any] = {
        "command": command("study learning", **options),
        "moves": moves,
        "repetitions": repetitions,
        "shaper": shaper,
        "seed": seed,
        "plants": report(done),
    }
    give(result, _print, json=json)


def _print(result: dict[str, Any]) -> None:
    from tvist_lab.studies.learning import columns

    show(f"learning with {result['shaper']}", result["plants"], columns(result["repetitions"]))
    words(TERMS)
