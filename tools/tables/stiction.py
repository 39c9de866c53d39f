"""Show how exactly stiction must be known: move `ur5e_stiction` by controllers with wrong friction values."""

from functools import partial

from tvist_controller.api.line import load_calibration
from tvist_lab.study.case import Case, arm_seed
from tvist_lab.study.catalogue import some
from tvist_lab.study.moves import draw_moves
from tvist_lab.study.study import Study
from tvist_plant.description import load
from tvist_plant.imperfections import STICTION
from tvist_plant.variants import Variant, in_file, rubbed

SEED, MOVES = 20327, 40
BELIEFS = {
    "right": {},
    "without stiction": {"stiction": 0.0, "stiction_load": 0.0},
    "F_s, μ_s -30 %": {"stiction": 0.7, "stiction_load": 0.7},
    "F_s, μ_s +30 %": {"stiction": 1.3, "stiction_load": 1.3},
    "F_c -20 %": {"coulomb_friction": 0.8},
    "F_c +20 %": {"coulomb_friction": 1.2},
    "σ / 3": {"stiction_stiffness": 1.0 / 3.0},
    "v_s × 1.5": {"stiction_speed": 1.5},
    "all -20 %": dict.fromkeys((*STICTION, "coulomb_friction"), 0.8),
    "all +20 %": dict.fromkeys((*STICTION, "coulomb_friction"), 1.2),
    "F_c -20 %, others +20 %": {"coulomb_friction": 0.8, **dict.fromkeys(STICTION, 1.2)},
    "F_c +20 %, others -20 %": {"coulomb_friction": 1.2, **dict.fromkeys(STICTION, 0.8)},
}
"""Errors of the controller: factors of its parameters, see `rubbed`."""
ROBOT = load("ur5e_stiction")

STUDY = Study(
    title="Friction that is known wrongly",
    cases=[
        Case(
            rubbed(factors, ROBOT),
            move,
            arm_seed(SEED, number),
            arms=(Variant("true", "as its robot file says", partial(in_file, ROBOT)),),
            axes={"controller": belief, "move": number},
        )
        for belief, factors in BELIEFS.items()
        for number, move in enumerate(draw_moves(ROBOT, MOVES, SEED, (0.0, ROBOT.limits.payload)).moves)
    ],
    methods=some(["zv", "auto", "elastic-16"], ROBOT, load_calibration("ur5e_stiction_modal")),
    by=("controller",),
)
