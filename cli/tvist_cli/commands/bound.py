"""`tvist bound`: how much time a motion needs at least to end without vibration, and how much shapers take."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from tvist_cli.failure import Failure, told
from tvist_cli.output import out, print_json, progress, table, typed, words
from tvist_cli.simulated_arm import UNIFORM, disturbed, masses_of, named

if TYPE_CHECKING:
    from tvist_lab.bound.report import Bounded, BoundJob
    from tvist_lab.study.moves import Move
    from tvist_plant.description import RobotDescription

ROBOT, CALIBRATION = "ur5e", "ur5e_modal"
"""The arm, and its calibration."""


def bound(
    *,
    random: int = 30,
    seed: int = 0,
    payload: str = UNIFORM,
    shapers: Annotated[list[str] | None, Parameter(consume_multiple=True)] = None,
    markdown: Path | None = None,
    json: bool = False,
) -> None:
    """Compute the least time that moves need to end without vibration, and measure what shapers take.

    The moves are the paper's three with 5 kg, and random ones of a UR5e. The bound is the extra time of the fastest
    motion that keeps the limits and leaves the four lowest modes at rest, for an arm without feed-forward of its
    elasticity. Each shaper makes each move on an arm without friction, gear errors and noise.

    Args:
        random: Number of random moves.
        seed: Seed of random moves and payloads.
        payload: Mass of the disc on the flange in kg for random moves; uniform draws one for each move, from 0 to the
            arm's rating.
        shapers: Names of the shapers to compare [zv auto auto-target planned].
        markdown: File to write the page to.
        json: Print one JSON object.
    """
    from tvist_controller.calibrations import load as load_calibration
    from tvist_controller.refusal import RefusalError
    from tvist_lab.bound.markdown import page
    from tvist_lab.bound.report import SHAPERS, BoundJob, report
    from tvist_lab.study.recipes import Recipe
    from tvist_plant.description import load

    if not 0 <= random <= 100_000:
        raise Failure(f"random is {random}: must be 0 to 100000", code=2)
    if not 0 <= seed < 2**63:
        raise Failure(f"seed is {seed}: must be at least 0 and less than 2^63", code=2)
    plant, kept = disturbed(load(ROBOT), None, clean=True)
    known = load_calibration(CALIBRATION)
    chosen = tuple(dict.fromkeys(name.lower() for name in shapers)) if shapers else SHAPERS
    for name in chosen:
        with told(RefusalError, code=2):
            Recipe(name, known).make(plant, 0.0)
    moves = _moves(plant, random, seed, masses_of(payload, plant))
    found = _found([BoundJob(name, plant, known, chosen, move) for name, move in moves])
    result = {
        "command": " ".join(
            ["tvist", "bound", "--random", str(random), "--seed", str(seed)]
            + ([] if payload == UNIFORM else ["--payload", payload])
            + ([] if shapers is None else ["--shapers", *shapers])
        ),
        "calibration": known.name,
        "plant": named(kept),
        "seed": seed,
        **report(found),
    }
    with told(OSError):
        if markdown is not None:
            markdown.write_text(page({**result, "command": typed()}), encoding="utf-8")
    if json:
        print_json(result)
        return
    from tvist_lab.bound.report import SUMMARY, TERMS, move_columns, move_rows, summary_rows

    table("each move", move_columns(result), move_rows(result))
    table(f"{len(found)} moves, arm {result['plant']}", SUMMARY, summary_rows(result))
    words(TERMS)
    out.print(f"the bound is {result['bound_ms']['median']:.0f} ms in the median")


def _moves(
    description: "RobotDescription", random: int, seed: int, masses: tuple[float, float]
) -> "list[tuple[str, Move]]":
    """The paper's moves and random ones, with their names."""
    from tvist_lab.study.moves import Move, draw_moves

    poses = description.poses
    paper = [
        (f"{start}-{target}", Move(tuple(poses[start]), tuple(poses[target]), description.payload.mass))
        for start, target in (("Q1", "Q2"), ("Q1", "Q3"), ("Q3", "Q1"))
    ]
    drawn = draw_moves(description, random, seed, masses).moves if random else []
    return paper + [(str(number), move) for number, move in enumerate(drawn, 1)]


def _found(jobs: "list[BoundJob]") -> "list[Bounded]":
    from tvist_lab.bound.report import compare

    found = []
    with progress(len(jobs), "moves") as bar:
        for one in compare(jobs):
            found.append(one)
            bar(1, None)
    return found
