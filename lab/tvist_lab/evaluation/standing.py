"""The candidates of the benchmark."""

from collections.abc import Sequence
from pathlib import Path

from tvist_controller.api import OwnShaper
from tvist_lab.evaluation.baselines import baselines, longest_mean_delay
from tvist_lab.evaluation.candidates import Candidate, Held, Longer, Named, Shaping
from tvist_lab.evaluation.foreign import FromFile
from tvist_lab.evaluation.recipes import Recipe
from tvist_lab.evaluation.shaperbench import PAYLOAD_ERRORS
from tvist_plant.description import RobotDescription
from tvist_protocol.calibration import Calibration

OWN = (
    ("zv", 1, "TVIST-ZV, lowest mode"),
    ("zv", 3, "TVIST-ZV, three modes"),
    ("zvd", 1, "TVIST-ZVD, lowest mode"),
    ("ei", 1, "TVIST-EI, lowest mode"),
    ("auto", 1, "constant mean delay, auto"),
    ("short", 1, "constant mean delay, short"),
    ("auto-target", 1, "constant mean delay, given the end of each move"),
    ("elastic", 1, "smoothing, elastic feed-forward"),
    ("elastic-position", 1, "smoothing, elastic feed-forward without torques"),
    ("elastic-auto", 1, "auto, smoothing, elastic feed-forward"),
)
"""Our shapers: name, number of modes, description."""
PRODUCT_MODES = 3
"""Number of modes in the product of zero-vibration shapers."""


def candidates(
    description: RobotDescription,
    calibration: Calibration,
    mine: str | OwnShaper | None,
    against: Sequence[str] | None,
) -> list[Candidate]:
    """Return the candidates.

    Args:
        description: The robot.
        calibration: Calibration with a modal model, the source of all estimates.
        mine: The user's own shaper: path of a file with a class that has `step`, or a loaded shaper.
        against: Names of the candidates to run besides waiting, with which all are compared; None for all.

    Raises:
        KeyError: There is no candidate of that name.
    """
    waiting = Named(Recipe("none", calibration), "none", "waiting, unshaped")
    recipe = Recipe("zv", calibration)
    own = [
        Named(Recipe(name, calibration, modes=modes), name if modes == 1 else f"{name}_{modes}_modes", label)
        for name, modes, label in OWN
    ]
    last = next(one for one in own if one.name == "auto")
    ranged = baselines(recipe, description, (0.0, description.limits.payload))
    fixed = [Shaping(recipe, one, one.name, one.label) for one in ranged if one.shaper is not None]
    longer = [
        Longer(one, f"double_s_as_{one.name}", f"double S as long as {one.name}") for one in (own[0], last)
    ]
    every: list[Candidate] = [waiting, *longer, *fixed, *own, _product(recipe, description)]
    if against is not None:
        by_name = {one.name: one for one in every}
        every = [waiting, *(by_name[name] for name in against if name != waiting.name)]
    if isinstance(mine, OwnShaper):
        every.append(Named(Recipe(mine.name, calibration, own=(mine,)), mine.name, mine.place))
    elif mine is not None:
        every.append(FromFile(mine, recipe, _called(Path(mine), [one.name for one in every]), mine))
    return every


def _called(file: Path, taken: list[str]) -> str:
    """Name of the user's shaper in tables and figures: its file's, unless another one has that."""
    return f"{file.stem}.py" if file.stem in taken else file.stem


def _product(recipe: Recipe, description: RobotDescription) -> Held:
    """Return the product, delayed to its longest mean delay over the workspace and all declared payloads."""
    most = (1.0 + max(PAYLOAD_ERRORS)) * description.limits.payload
    delay = longest_mean_delay(recipe, description, (0.0, most), PRODUCT_MODES)
    return Held(recipe, delay, PRODUCT_MODES, "product", "constant mean delay, product of three ZV")
