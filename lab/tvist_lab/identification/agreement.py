"""Find ring-downs that contradict the others, and cross-validate the fit."""

from collections.abc import Sequence

import numpy as np

from tvist_lab.identification.forecast import LeftOut
from tvist_lab.identification.modal_fit import MODES, ModalFit, describe, fit_modal, own_poles_near
from tvist_lab.identification.ring_downs import IdentificationError, Ringing
from tvist_lab.identification.unknowns import ArmModes
from tvist_lab.recordings import Floats

CONTRADICTION = 0.2
"""Share of a ring-down explained only by its own poles from which it contradicts the others [-]."""
SIGNIFICANT = 60.0
"""Significance required for a contradiction, to exclude noise; see `OwnPoles.significance` [-]."""
SUSPECTS = 3  # number of ring-downs that are left out in turn
GUILTY = 3  # if more than one in this number is wrong, the wrong ring-downs cannot be determined
SINGLY = 14  # largest number of configurations that are left out one by one
FOLDS = 10  # number of parts into which more configurations are divided


def contradicting(arm: ArmModes, ringings: Sequence[Ringing]) -> list[int]:
    """Find ring-downs that no springs and drives can explain together with the others."""
    # A wrong ring-down also spoils the fit of the others. Among the worst explained ones, the one whose
    # omission gives the best fit is therefore left out, until the rest agree.
    fit = fit_modal(arm, ringings)
    rest = list(range(len(ringings)))
    guilty: list[int] = []
    while len(guilty) <= len(ringings) // GUILTY:
        explained = {number: own_poles_near(arm, ringings[number], fit) for number in rest}
        worst = sorted(rest, key=lambda number: -explained[number].share)[:SUSPECTS]
        if all(own.share < CONTRADICTION or own.significance < SIGNIFICANT for own in explained.values()):
            return sorted(guilty)
        without = {
            number: fit_modal(arm, [ringings[other] for other in rest if other != number], fit.logarithms)
            for number in worst
        }
        removed = min(worst, key=lambda number: without[number].cost)
        guilty.append(removed)
        rest.remove(removed)
        fit = without[removed]
    raise IdentificationError(
        f"the {len(ringings)} ring-downs contradict each other: no springs and drives explain them together. Was "
        "the payload the declared one each time, is the robot the one of the file, and did nothing shake it?"
    )


def cross_validate(arm: ArmModes, ringings: Sequence[Ringing], fit: ModalFit) -> tuple[list[LeftOut], Floats]:
    """Fit without each configuration in turn, or without each of `FOLDS` parts of many configurations.

    Also return the jackknife covariance of the parameters' logarithms, shape (P, P), which includes model
    errors as well as noise.
    """
    places = {place: number for number, place in enumerate(dict.fromkeys(r.q.tobytes() for r in ringings))}
    folds = len(places) if len(places) <= SINGLY else FOLDS
    logarithms, left = [], []
    for fold in range(folds):
        out = [r for r in ringings if places[r.q.tobytes()] % folds == fold]
        others = [r for r in ringings if places[r.q.tobytes()] % folds != fold]
        unseen = fit_modal(arm, others, fit.logarithms)
        logarithms.append(unseen.logarithms)
        for ringing in out:
            poles = unseen.drivetrain.poles(arm.mass(ringing.q, ringing.payload))[0][:MODES]
            left.append(LeftOut(ringing, *describe(poles), own_poles_near(arm, ringing, unseen)))
    apart = np.array(logarithms) - np.mean(logarithms, axis=0)
    return left, (folds - 1) / folds * apart.T @ apart
