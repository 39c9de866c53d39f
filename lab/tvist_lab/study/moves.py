"""Moves and streams to evaluate, read from a file or drawn at random."""

import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import msgspec
import numpy as np
import ruckig
from msgspec import Meta, Struct

from tvist_controller.api.line import CollisionModel, JointLine, MotionLimits, body, paper_payload
from tvist_lab.recordings import Floats
from tvist_lab.study.line import PAPER
from tvist_lab.workspace import WORKSPACE, Region, workspace
from tvist_plant.description import RobotDescription
from tvist_plant.plant import PERIOD
from tvist_plant.user_file import read_bytes
from tvist_protocol.content import checked, parse_json
from tvist_protocol.errors import ProtocolError
from tvist_protocol.values import Angle, Mass

MIN_TURN = 1e-4  # rotation of the fastest joint below which a move counts as going nowhere [rad]
STROKE = (0.3, 1.0)  # length of a random move, as a share of the way to an independent configuration [-]
TRIES = 1000  # number of draws for one random move before giving up
RETARGETED = (0.2, 0.8)  # shortest and longest time after which a stream turns to another target [s]
TURNS = 4
WITH_WRISTS = Region(low=(*WORKSPACE.low, -np.pi, -np.pi), high=(*WORKSPACE.high, np.pi, np.pi))
"""The workspace with any angles of the wrist's two outer joints."""


class MovesError(ValueError):
    """Moves cannot be evaluated; the message names the move, the joint and the limit."""


@dataclass(frozen=True)
class Move:
    """A move from rest to rest."""

    start: tuple[float, ...]  # joint angles at the start [rad]
    target: tuple[float, ...]  # joint angles at the end [rad]
    mass: float  # mass of the payload [kg]


class _Entry(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True, omit_defaults=True):
    """A move in a file."""

    start: tuple[Angle, ...]
    target: tuple[Angle, ...]
    payload: Mass | None = None  # payload of this move [kg]; None for the one on the command line


Entries = Annotated[tuple[_Entry, ...], Meta(min_length=1)]


def read_moves(path: Path, description: RobotDescription, masses: Callable[[], float]) -> list[Move]:
    """Read and check a file of moves; `masses` gives the payload of each move without one [kg]."""
    try:
        entries = checked(parse_json(read_bytes(path, "moves")), Entries)
    except OSError as error:
        raise MovesError(f"moves {path}: {error.strerror}") from error
    except ProtocolError as error:
        raise MovesError(f"moves {path}: {_in_words(error.why)}") from error
    moves = [
        Move(entry.start, entry.target, masses() if entry.payload is None else entry.payload)
        for entry in entries
    ]
    for number, move in enumerate(moves, 1):
        try:
            _check(number, move, description)
        except MovesError as error:
            raise MovesError(f"moves {path}: {error}") from error
    return moves


def write_moves(path: Path, moves: Sequence[Move]) -> None:
    """Write a file for `read_moves`."""
    entries = [_Entry(start=move.start, target=move.target, payload=move.mass) for move in moves]
    path.write_bytes(msgspec.json.format(msgspec.json.encode(entries), indent=1) + b"\n")


@dataclass(frozen=True)
class Drawn:
    """Random moves, and the number of draws that they took."""

    moves: list[Move]
    draws: int

    @property
    def share(self) -> float:
        """Share of the draws that were free of collisions [-]."""
        return len(self.moves) / self.draws


def draw_moves(
    description: RobotDescription,
    count: int,
    seed: int,
    masses: tuple[float, float],
    *,
    wrists: bool = False,
    stroke: tuple[float, float] = STROKE,
) -> Drawn:
    """Draw random moves in the workspace, free of collision from start to target.

    `masses` are the smallest and largest carried mass [kg]; `stroke` the smallest and largest length, as a share of
    the way to an independent configuration [-]; with `wrists`, the two outer wrist joints turn as well. Raises
    MovesError if hardly any draw is free, or the arm has no wrist.
    """
    if wrists and description.joints <= len(WORKSPACE.low):
        raise MovesError(
            f"wrists: a {description.robot.model} has {description.joints} joints, and wrists need at least 5"
        )
    random = np.random.default_rng(seed)
    collision = CollisionModel(description, body(paper_payload(description, masses[1])))
    region = WITH_WRISTS if wrists else workspace(description)
    moves: list[Move] = []
    draws = 0
    for draws, move in enumerate(_draws(random, region, description.joints, masses, stroke), 1):
        collision.declare(body(paper_payload(description, move.mass)))
        if is_free(collision, move):
            moves.append(move)
        if len(moves) == count:
            break
        if draws >= TRIES * (len(moves) + 1):
            raise MovesError(f"random: {draws} draws gave {len(moves)} moves without a collision")
    return Drawn(moves, draws)


def stopped_stream(
    description: RobotDescription, start: Floats, seed: int, limits: MotionLimits = PAPER
) -> Floats:
    """Draw a stream at its limits that is stopped before it reaches its last target, shape (T, n) [rad]."""
    joints, random = len(start), np.random.default_rng([seed, 71])
    region = workspace(description)
    used = min(len(region.low), joints)
    generator = ruckig.Ruckig(joints, PERIOD)
    state, following = ruckig.InputParameter(joints), ruckig.OutputParameter(joints)
    state.max_velocity = [limits.velocity] * joints
    state.max_acceleration = [limits.acceleration] * joints
    state.max_jerk = [limits.jerk] * joints
    state.current_position = np.asarray(start, dtype=float).tolist()
    out: list[Floats] = []

    def step() -> bool:
        result = generator.update(state, following)
        following.pass_to_input(state)
        out.append(np.array(state.current_position))
        return bool(result == ruckig.Result.Finished)

    for _ in range(TURNS):
        target = np.zeros(joints)
        target[:used] = random.uniform(np.array(region.low)[:used], np.array(region.high)[:used])
        state.target_position = target.tolist()
        for _ in range(round(random.uniform(*RETARGETED) / PERIOD)):
            step()
    state.control_interface = ruckig.ControlInterface.Velocity
    state.target_velocity = state.target_acceleration = [0.0] * joints
    while not step():
        pass
    return np.array(out)


def is_free(collision: CollisionModel, move: Move) -> bool:
    """Whether the straight line in joint space is free of collision with arm and floor."""
    return collision.meeting(np.array(move.target)) is None and meeting(collision, move) is None


def meeting(collision: CollisionModel, move: Move) -> str | None:
    """Return which bodies meet on a move, as text; None if none do."""
    start, target = np.array(move.start), np.array(move.target)
    if (nearest := collision.meeting(start)) is not None:
        return f"{nearest.first} meets {nearest.second} at the start"
    found = collision.on_way(JointLine(start, target).whole)
    if found is None:
        return None
    share, pair = found
    return f"{pair.first} meets {pair.second} at {100.0 * share:.0f} % of the way"


def collisions(description: RobotDescription, moves: Sequence[Move]) -> list[str | None]:
    """Return which bodies meet on each move."""
    collision = CollisionModel(description, body(paper_payload(description, 0.0)))
    found = []
    for move in moves:
        collision.declare(body(paper_payload(description, move.mass)))
        found.append(meeting(collision, move))
    return found


def _draws(
    random: np.random.Generator,
    region: Region,
    joints: int,
    masses: tuple[float, float],
    stroke: tuple[float, float],
) -> Iterator[Move]:
    used = min(len(region.low), joints)
    low, high = (np.array(side)[:used] for side in (region.low, region.high))
    while True:
        start, far = np.zeros((2, joints))
        start[:used], far[:used] = random.uniform(low, high), random.uniform(low, high)
        mass, share = random.uniform(*masses), random.uniform(*stroke)
        target: Floats = start + share * (far - start)
        yield Move(tuple(start.tolist()), tuple(target.tolist()), mass)


def _check(number: int, move: Move, description: RobotDescription) -> None:
    joints = description.robot.joints
    for end, q in (("start", move.start), ("target", move.target)):
        if len(q) != len(joints):
            model = description.robot.model
            raise MovesError(f"move {number}: {end} has {len(q)} angles: must be {len(joints)} for a {model}")
        for joint, (angle, limit) in enumerate(zip(q, description.limits.position, strict=True)):
            if abs(angle) > limit:
                raise MovesError(
                    f"move {number}: {end} of joint {joint + 1} ({joints[joint]}) is {angle:g}: "
                    f"must be within ±{limit:.6g} rad"
                )
    if max(abs(a - b) for a, b in zip(move.start, move.target, strict=True)) < MIN_TURN:
        raise MovesError(f"move {number} is too short: a joint must turn by at least {MIN_TURN:g} rad")


def _in_words(why: str) -> str:
    """Convert the position in an error message to words: `[2].start[1]` becomes move 3, start, joint 2."""
    words = re.sub(r"^\[(\d+)\]\.?", lambda found: f"move {int(found[1]) + 1}, ", why)
    words = re.sub(
        r"^(move \d+, \w+)\[(\d+)\]", lambda found: f"{found[1]}, joint {int(found[2]) + 1}", words
    )
    return re.sub(r"^(move \d+), (?=has|must|is )", r"\1 ", words)
