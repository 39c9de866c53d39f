"""Checks of a plant, which may be a user's own."""

import math

import numpy as np

from tvist_plant.plant import Measurement, Pacing, Plant, PlantError, Sight, Standing, Supervised


def check_unpaced(plant: Plant) -> None:
    """Check that a plant may be moved as fast as a machine computes, without a clock.

    Raises:
        ValueError: It gives the tick, so it may be a real arm.
    """
    paced = isinstance(plant, Pacing)
    if paced:
        name = type(plant).__name__
        raise ValueError(
            f"the plant {name} gives the tick: it moves in real time only, and not as fast as this machine computes"
        )


def measured_standing(plant: Plant, joints: int) -> Measurement:
    """Return what a plant that cannot be placed measures where it stands.

    Args:
        plant: The plant.
        joints: Number of joints in the robot's description.

    Raises:
        ValueError: The plant does not answer, its measurement has the wrong shape or is not finite, or it can
            neither be placed nor measured.
    """
    name = type(plant).__name__
    if not isinstance(plant, Standing):
        raise ValueError(f"the plant {name} has neither reset nor measure: it needs one of them")  # noqa: TRY004  it is a value of the user's
    try:
        measured = plant.measure()
    except PlantError as error:
        said = "" if isinstance(plant, Supervised) else f"plant {name}: where it stands is unknown: "
        raise ValueError(f"{said}{error}") from error
    check_measurement(measured, joints, plant)
    if not np.isfinite(measured.q).all():
        raise ValueError(f"plant {name}: measured q is {measured.q.tolist()}: must be finite")
    return measured


def check_measurement(measured: Measurement, joints: int, plant: Plant) -> None:
    """Check the first measurement of a plant, which may be a user's own.

    Args:
        measured: Measurement that it returned.
        joints: Number of joints in the robot's description.
        plant: The plant, named in the error.

    Raises:
        ValueError: An array is missing or has the wrong shape, for example for another number of joints.
    """
    shapes = {"q": (joints,), "qd": (joints,), "moment": (joints,), "accelerometer": (3,)}
    if getattr(measured, "wrench", None) is not None:
        shapes["wrench"] = (6,)
    for name, shape in shapes.items():
        found = getattr(getattr(measured, name, None), "shape", None)
        if found != shape:
            what = "is not an array" if found is None else f"has shape {found}"
            raise ValueError(
                f"plant {type(plant).__name__}: measured {name} {what}: its shape must be {shape}"
            )


def check_sight(sight: Sight, joints: int) -> None:
    """Check what a robot that its own controller moves has said; a `ValueError` names the field that is wrong."""
    felt, load = sight.measured, sight.payload
    measured = np.concatenate((felt.q, felt.qd, felt.moment)).tolist()
    body = None if load is None else (load.mass, *load.com, *load.inertia)
    for name, said, count in (  # whose sums are finite only if they are, and quicker to see than by numpy
        ("target", np.ravel(sight.target).tolist(), 4 * joints), ("measured", measured, 3 * joints),
        ("modes", sight.modes, 3), ("speed", (sight.speed,), 1), ("tick", (sight.tick,), 1),
        ("tool", sight.tool, 6), ("force", sight.force, 6), ("payload", body, 10),
    ):  # fmt: skip
        if said is not None and (len(said) != count or not math.isfinite(sum(said))):
            raise ValueError(f"{name} is {said}: must be {count} finite numbers")
    if sight.slider is not None and not 0.0 <= sight.slider <= 1.0:
        raise ValueError(f"slider is {sight.slider:g}: must be 0 to 1")
