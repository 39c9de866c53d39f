"""`tvist study match`: two shapers on the same moves and plants, and whether one is better."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

from tvist_cli.failure import Failure, told
from tvist_cli.output import out
from tvist_cli.shapers_of import calibration_for, calibration_of, designing, loaded, own_modal
from tvist_cli.simulated_arm import disturbed, limits_of, named, plants_of
from tvist_cli.studying import Places, check_range, check_seed, command, gathered, give, show

if TYPE_CHECKING:
    from tvist_lab.study.method import Method
    from tvist_plant.description import RobotDescription


def match(
    first: str,
    second: str,
    /,
    *,
    moves: int | None = None,
    plants: Annotated[list[str] | None, Parameter(consume_multiple=True)] = None,
    hidden: Annotated[list[int] | None, Parameter(consume_multiple=True)] = None,
    payload: tuple[float, float] | None = None,
    robot: str = "ur5e",
    calibration: str | None = None,
    limits: str = "gentle",
    clean: bool = False,
    seed: int = 0,
    output: Path | None = None,
    json: bool = False,
) -> None:
    """Compare two shapers on the same random moves, plant by plant, and say where one is better.

    Both make each move on each plant, as a robot makes it. The difference of their reductions has a 95 % interval: that
    of the median is exact (sign test), that of the 5th percentile a bootstrap over pairs. One is better on a plant if
    the interval of the median is on one side of zero. Of twenty plants without a difference, one is called different.

    Args:
        first: Any name that tvist shapers or tvist shaperbench list, or FILE.py:NAME, which runs that file.
        second: The other one, likewise.
        moves: Number of moves, at least 20 [60].
        plants: Names of plants, such as calibrated, stribeck, hysteresis, torsion, base, backlash, combined, springs-30
            and springs+30 [these; an arm none of whose links bends has no torsion].
        hidden: Seeds of hidden robots, each of which is a plant, too: its springs, dampers, loops, rotors, friction and
            payload are drawn from its seed.
        payload: Smallest and largest mass of the disc on the flange in kg [0 and the arm's rating].
        robot: Name of a robot that comes with the package, or path of a robot file.
        calibration: Name of a calibration that comes with the package, or path of a calibration file
            [the modal one that comes with the package for this robot].
        limits: gentle for 1.5 rad/s, 2 rad/s² and 100 rad/s³; or industrial for 3 rad/s, 8 rad/s² and 2000 rad/s³.
            Moves for which the drives are too weak are left out.
        clean: Simulate without gear errors and noise, and without nonlinear friction where a plant has none of its own.
        seed: Seed of moves, payloads, gear errors and what plants draw.
        output: JSON file to write the result to.
        json: Print one JSON object.
    """
    from tvist_lab.studies.evaluate import feasible
    from tvist_lab.studies.match import jobs, report
    from tvist_lab.study.engine import made
    from tvist_lab.study.held_out import LEAST, MOVES, said
    from tvist_lab.study.moves import MovesError, draw_moves
    from tvist_lab.study.shaping import ShaperFaultError
    from tvist_plant.description import DescriptionError, load

    places = Places(output=output)
    places.check()
    moves = MOVES if moves is None else moves
    check_range("moves", moves, LEAST, 10_000)
    check_seed(seed)
    chosen = limits_of(limits)
    with told(DescriptionError, code=2):
        description = load(robot)
    masses = (0.0, description.limits.payload) if payload is None else payload
    if not 0.0 <= masses[0] <= masses[1] <= 100.0:
        raise Failure(
            f"payload is {masses[0]:g} {masses[1]:g}: must be two increasing masses of 0 to 100 kg", code=2
        )
    arms = plants_of(plants, hidden, description)
    arm, kept = disturbed(description, None, clean=clean)
    pair = _method(first, arm, calibration), _method(second, arm, calibration)
    if pair[0].name == pair[1].name:
        raise Failure(f"both shapers are {pair[0].name}: give two different ones", code=2)
    with told(MovesError, code=2):
        drawn = draw_moves(description, moves, seed, masses).moves
    able = feasible(drawn, description, chosen)
    if len(able) < LEAST:
        raise Failure(
            f"moves is {moves}, but the drives are strong enough for {len(able)} alone at these limits: must be at "
            f"least {LEAST} of them",
            code=2,
        )
    todo = jobs(arm, pair, arms, able, seed, chosen)
    done = gathered(
        made(todo), sum(job.motions for job in todo), "motions", ShaperFaultError, ValueError, weigh=len
    )
    options = {
        "moves": moves, "plants": plants, "hidden": hidden, "payload": payload, "robot": robot,
        "calibration": calibration, "limits": limits, "clean": clean, "seed": seed,
    }  # fmt: skip
    result: dict[str, Any] = {
        "command": command(f"study match {first} {second}", **options),
        "shapers": [one.name for one in pair],
        "robot": description.robot.name,
        "moves": len(todo),
        "too_weak": moves - len(todo),
        "seed": seed,
        "payload_kg": list(masses),
        "limits": limits,
        "arm": named(kept),
        "held_out": said(seed),
        "plants": report(pair, arms, [row for rows in done for row in rows]),
    }
    places.write(result)
    give(result, _print, json=json)


def _method(name: str, description: "RobotDescription", calibration: str | None) -> "Method":
    """Return a method of the catalogue, or the shaper of a file."""
    from tvist_lab.study.catalogue import some
    from tvist_lab.study.method import Named
    from tvist_lab.study.recipes import Recipe

    shaper, own = loaded(name)
    if own:
        known = calibration_for(calibration, shaper, own, 1, description)
        with designing():
            method = Named(Recipe(shaper, known, own=own), shaper, own[0].place)
            method.recipe.make(description, description.limits.payload)
        return method
    found = own_modal(description) if calibration is None else calibration_of(calibration)
    try:
        with designing():
            return some([shaper], description, found)[0]
    except KeyError as error:
        raise Failure(f"shaper is {name!r}: {error.args[0]}", code=2) from error


def _print(result: dict[str, Any]) -> None:
    from tvist_lab.studies.match import table

    show(
        f"reduction in % of {' and '.join(result['shapers'])} over {result['moves']} moves, arm {result['arm']}",
        result["plants"],
        table(*result["shapers"]),
    )
    out.print(
        "difference: first minus second in points, with its 95 % interval, exact for the median, a bootstrap for p5;\n"
        "better: the interval of the median is on one side of zero, for each plant by itself.",
        markup=False,
    )
    out.print(result["held_out"])
    if result["too_weak"]:
        out.print(f"{result['too_weak']} further moves were left out: the drives are too weak")
