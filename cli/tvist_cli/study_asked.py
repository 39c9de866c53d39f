"""Load and check the robots, shapers and moves of a requested study."""

from collections.abc import Sequence
from dataclasses import replace
from hashlib import sha256
from pathlib import Path

import msgspec
import numpy as np

from tvist_cli.failure import Misuse, check_range, failing_on
from tvist_cli.shapers_of import load_given, loaded
from tvist_cli.study_options import StudyOptions
from tvist_cli.studying import check_seed
from tvist_controller.planning.filter_planner import wanted_modes
from tvist_controller.refusal import RefusalError
from tvist_controller.sources import calibrations
from tvist_controller.sources.mode_source import modal_source
from tvist_controller.sources.own_files import is_file
from tvist_controller.sources.own_shapers import OwnShaper
from tvist_lab.studies.presets import PRESETS
from tvist_lab.studies.sweep import NamedRobot, Spec, SweptRobot, digest, read_spec, study
from tvist_lab.study.case import LIMITS
from tvist_lab.study.catalogue import baselines, some
from tvist_lab.study.foreign import CandidateError, FromFile, load_shaper
from tvist_lab.study.held_out import said
from tvist_lab.study.method import Method, Named
from tvist_lab.study.method_list import UNSHAPED, names
from tvist_lab.study.moves import STROKE, Move, MovesError, collisions, draw_moves, read_moves, write_moves
from tvist_lab.study.recipes import Recipe, RecipeError
from tvist_lab.study.request import Preset, StudyRequest
from tvist_lab.study.study import Study, StudyError
from tvist_plant.description import DISTURBANCES, DescriptionError, RobotDescription, load, robots
from tvist_plant.variants import Variant, hidden_variant, scattered, variant
from tvist_protocol.calibration import Calibration, CalibrationError
from tvist_shaping import Registry
from tvist_shaping.errors import ShapingError

Shaper = str | OwnShaper
OF_SHAPERS = (CalibrationError, RecipeError, RefusalError, ShapingError)
"""Errors that are raised if a shaper cannot be made for an arm with a calibration."""


def preset_study(name: str, options: StudyOptions) -> Study:
    """Return a study that comes with the package, with the requested options."""
    preset = PRESETS[name]
    of_others = {one for other in PRESETS.values() for one in other.options} - preset.options
    for option in options.given:
        if option in of_others or (option == "baselines" and preset.defaults is None):
            raise Misuse(f"--{option.replace('_', '-')} is not for {name}: see tvist study --help")
    _check(options)
    with failing_on(StudyError, MovesError, DescriptionError, CandidateError, *OF_SHAPERS, exit_code=2):
        asked = _asked(preset, name, options)
        made = preset.study(asked)
        made.check()
    if options.save_moves is not None:
        write_moves(options.save_moves, asked.moves)
    own = [each.sha256 for one in asked.methods if isinstance(one, Named) for each in one.recipe.own]
    files = [Path(one.path).read_bytes() for one in asked.methods if isinstance(one, FromFile)]
    contents = {
        "contents of robot": digest(asked.description),
        "contents of calibrations": [digest(one) for one in _calibrations(asked.methods)],
        "contents of shapers": [*own, *(sha256(one).hexdigest() for one in files)],
        "contents of moves": digest([msgspec.to_builtins(one) for one in asked.moves]),
    }
    return replace(made, identity=contents)


def _check(options: StudyOptions) -> None:
    check_seed(options.seed)
    check_range("modes", options.modes, 1, 6)
    for name, low, high in (
        ("frequency", -90.0, 900.0),
        ("payload", -100.0, 900.0),
        ("stiffness", 0.0, 90.0),
    ):
        check_range(f"{name}-error", getattr(options, f"{name}_error"), low, high, " %")
    if options.streams and options.save_moves is not None:
        raise Misuse("--save-moves writes moves, but --streams follows streams: leave one out")
    if options.clean and options.disturbances is not None:
        raise Misuse("give either --clean or --disturbances")
    for name in ("wrists", "stroke"):
        if name in options.given and not options.moves.isdigit():
            raise Misuse(f"--{name} is for random moves: it does not change the moves of a file")
    low, high = options.stroke or STROKE
    if not 0.001 <= low <= high <= 1.0:
        raise Misuse(f"stroke is {low:g} {high:g}: must be two increasing shares of 0.001 to 1")


def _asked(
    preset: Preset, name: str, options: StudyOptions, other: str = "", moves: Sequence[Move] = ()
) -> StudyRequest:
    """Load what options request. `other`: this robot instead, with its own calibration and these moves."""
    whole = load(other or options.robot)
    masses = _masses(options.payload, whole)
    wanted = "none" if options.clean else options.disturbances
    kept: tuple[str, ...] = DISTURBANCES
    if wanted is not None:
        kept = () if wanted == "none" else tuple(map(str.strip, wanted.split(",")))
    description = whole.disturbed_by(kept)
    given, error = None if other else options.calibration, 0.01 * options.frequency_error
    named, others = list[Method](), list[Method]()
    for shaper in (_shaper(one) for one in options.shapers or preset.shapers if one != UNSHAPED):
        known = _calibration(given, shaper, options.modes, description, modal=preset.modal)
        named += some([shaper], description, known, masses, options.modes, error)
    if preset.defaults is not None and (options.baselines or options.shapers is None):
        if preset.defaults != "baselines":
            known = _calibration(given, "", 1, description, modal=True)
            others += some(names(preset.defaults), description, known, masses)
        elif calibrated := _calibrations(named):
            others += baselines(calibrated[0], description, masses, error)
    always = list[Method]()
    if preset.always:
        always += some(preset.always, description, _calibration(given, "", 1, description, modal=True))
    methods = {one.name: one for one in (*always, *named, *others)}
    for one in methods.values():  # raises errors before anything is computed
        if isinstance(one, Named):
            one.recipe.elastic(description, one.recipe.make(description, masses[1]))
    moves, share = (moves, None) if other else _moves(options, whole, masses, preset.least)
    calibration = next(iter(_calibrations(list(methods.values()))), None)
    facts = {
        "command": _command(name, options), "seed": options.seed, "robot": whole.robot.name,
        "calibration": calibration and calibration.name, "moves_made": len(moves), "payload_kg": list(masses),
        "limits": options.limits, "streams": options.streams, "free_of_collision": share,
        "arm": "as described" if kept == DISTURBANCES else f"with {' and '.join(kept)} alone" if kept else "clean",
        "disturbances": list(kept), "held_out": said(options.seed),
    }  # fmt: skip
    return StudyRequest(
        description=description,
        moves=moves,
        methods=list(methods.values()),
        named=len({one.name for one in named}),
        arms=_arms(options, whole),
        seed=options.seed,
        limits=LIMITS[options.limits],
        payload_error=0.01 * options.payload_error,
        streams=options.streams,
        quick=options.quick,
        facts=facts,
        notes=[] if other else _notes(moves, share, whole, _calibrations(named), streams=options.streams),
        on=lambda robot: None if "robot" in options.given else _asked(preset, name, options, robot, moves),
    )


def _shaper(name: str) -> Shaper:
    """Convert a shaper given by the user to a lower-case name, the path of its file, or a loaded shaper."""
    if ".py:" in name:
        return load_given(name)
    if not name.endswith(".py"):
        return name.lower()
    load_shaper(Path(name))
    return name


def _calibration(
    given: str | None, shaper: Shaper, modes: int, description: RobotDescription, *, modal: bool
) -> Calibration | None:
    """Return the calibration named `given`, else the robot's own, which for several modes is a modal one."""
    own = (shaper,) if isinstance(shaper, OwnShaper) else ()
    name = shaper.name if isinstance(shaper, OwnShaper) else shaper
    known = Registry(one.shaper for one in own)
    try:
        several = (
            modal or wanted_modes(name, modes, "shaper", known) > 1 or known.feed_forward_of(name) != "rigid"
        )
    except RefusalError:  # not a shaper of the library; `some` reports unknown names
        several = modal = True
    if given is not None:
        found = calibrations.load(given)
        if modal and found.modal is None:
            raise Misuse(f"calibration {found.name} has no modal model: make one with tvist identify")
        return found
    default = calibrations.default_for(description.robot.model)
    if default is None and modal:
        model = description.robot.model
        raise Misuse(f"the package has no calibration of a {model}: give --calibration FILE")
    if default is None:
        return None
    calibration = calibrations.load(default)
    source = modal_source(description, calibration) if several else None
    return calibration if source is None else source.calibration


def _calibrations(methods: Sequence[Method]) -> list[Calibration]:
    found = (getattr(getattr(one, "recipe", None), "calibration", None) for one in methods)
    return list({one.name: one for one in found if one is not None}.values())


def _masses(payload: Sequence[float] | None, description: RobotDescription) -> tuple[float, float]:
    given = [0.0, description.limits.payload] if payload is None else list(payload)
    low, high = given[0], given[-1]
    if len(given) > 2 or not 0.0 <= low <= high <= 100.0:
        said = " ".join(f"{one:g}" for one in given)
        raise Misuse(f"payload is {said}: must be a mass of 0 to 100 kg, or two increasing ones")
    return low, high


def _moves(
    options: StudyOptions, description: RobotDescription, masses: tuple[float, float], least: int
) -> tuple[list[Move], float | None]:
    """Return the moves, and the share of randomly drawn ones without collision (None: read from a file)."""
    if not options.moves.lstrip("-").isdigit():
        drawn = np.random.default_rng(options.seed)
        return read_moves(Path(options.moves), description, lambda: float(drawn.uniform(*masses))), None
    check_range("moves", int(options.moves), least, 100_000)
    stroke = options.stroke or STROKE
    found = draw_moves(
        description, int(options.moves), options.seed, masses, wrists=options.wrists, stroke=stroke
    )
    return found.moves, found.share


def _arms(options: StudyOptions, description: RobotDescription) -> list[Variant]:
    """Return the requested plants: by name, hidden robots by seed, and an arm with changed springs."""
    for seed in options.hidden or ():
        check_seed(seed)
    with failing_on(ValueError, exit_code=2):
        found = [
            *(variant(name.lower()) for name in options.plants or ()),
            *map(hidden_variant, options.hidden or ()),
        ]
        for one in found:
            one.make(description, description.payload, 0)  # raises if the plant does not suit this arm
    if options.stiffness_error:
        found.append(scattered(0.01 * options.stiffness_error))
    return list({one.name: one for one in found}.values())  # a plant that is named twice counts once


def _notes(
    moves: Sequence[Move],
    share: float | None,
    description: RobotDescription,
    known: Sequence[Calibration],
    *,
    streams: bool,
) -> list[str]:
    found = []
    if share is not None:
        free = f"{100.0 * share:.0f} % of the drawn moves were free of collisions; the others were replaced"
        found.append("all drawn moves were free of collisions" if share == 1.0 else free)
    elif not streams:
        found += [
            f"move {place}: a robot would refuse it because {words}; it was made anyway"
            for place, words in enumerate(collisions(description, moves), 1)
            if words is not None
        ]
    for one in known:
        off = sum(abs(move.mass - one.payload.mass) > 0.02 * max(one.payload.mass, 1.0) for move in moves)
        if one.modal is None and off:
            found.append(
                f"calibration {one.name} was made with {one.payload.mass:g} kg; {off} moves carry something else"
            )
    return found


def _command(name: str, options: StudyOptions) -> str:
    """Return the command line that reproduces the study."""
    words = ["tvist study", name]
    for option, value in options.given.items():
        if option != "save_moves":
            values = [] if value is True else value if isinstance(value, list | tuple) else [value]
            said = (f"{one:g}" if isinstance(one, float) else str(one) for one in values)
            words += [f"--{option.replace('_', '-')}", *said]
    return " ".join(words)


def swept(path: Path) -> Study:
    """Read a sweep file and load all that it names; its paths are relative to its folder."""
    spec = read_spec(path)
    loaded_robots = [_robot(path, spec, place, named) for place, named in enumerate(spec.robots)]
    with failing_on(MovesError, where=f"sweep {path}: "):
        return study(spec, loaded_robots)


def _robot(path: Path, spec: Spec, place: int, named: str | NamedRobot) -> SweptRobot:
    robot, calibration = (named, None) if isinstance(named, str) else (named.robot, named.calibration)
    with failing_on(DescriptionError, where=f"sweep {path}: robots[{place}]: "):
        arm = load(robot if robot in robots() else path.parent / robot).disturbed_by(spec.disturbances)
    if calibration is not None and (path.parent / calibration).exists():
        calibration = str(path.parent / calibration)
    recipes = []
    for number, shaper in enumerate(spec.shapers):
        with failing_on(*OF_SHAPERS, where=f"sweep {path}: shapers[{number}] with robots[{place}]: "):
            recipes.append(_recipe(path, spec, shaper, calibration, arm))
    label = robot if isinstance(named, str) else f"{robot} with {named.calibration}"
    return SweptRobot(label, arm, tuple(recipes))


def _recipe(path: Path, spec: Spec, shaper: str, calibration: str | None, arm: RobotDescription) -> Recipe:
    # A relative path would fail on the workers of a cluster, which have other working folders.
    name, own = loaded(str((path.parent / shaper).resolve()) if is_file(shaper) else shaper)
    known = _calibration(calibration, own[0] if own else name, spec.modes, arm, modal=False)
    recipe = Recipe(name, known, modes=spec.modes, own=own)
    recipe.elastic(arm, recipe.make(arm, arm.limits.payload))
    return recipe
