"""The arms and how well their vibration is suppressed, as a page of the documentation."""

from typing import Any

from tvist_lab.studies.pages import page
from tvist_lab.study.tables import Shown

ARMS = (
    Shown("name", lambda one: f"`{one['name']}`"), Shown("model", "model"),
    Shown("joints", lambda one: len(one["joints"])), Shown("length m", "length_m", 2),
    Shown("payload kg", lambda one: f"{one['payload_kg']:g}"),
    Shown("largest torques N m", lambda one: ", ".join(f"{torque:g}" for torque in one["torque_n_m"])),
    Shown("calibrations", lambda one: ", ".join(one["calibrations"])),
)  # fmt: skip
MEASUREMENTS = (
    Shown("arm", lambda one: f"`{one['name']}`"),
    Shown("springs", lambda one: f"{100.0 * (one['stiffness'] - 1.0):+.0f} %"), Shown("calibration", "calibration"),
    Shown("f_d off by %", lambda one: ", ".join(f"{value:.1f}" for value in one["f_d_error_percent"])),
    Shown("moves", "counted"), Shown("too weak", "too_weak"),
    Shown("less % median", "reduction_percent.median", 1), Shown("p5", "reduction_percent.p5", 1),
    Shown("delay ms", "delay_ms", 0), Shown("sag off by %", "sag_error_percent", 2),
)  # fmt: skip


def robots_page(listed: list[dict[str, Any]], command: str) -> str:
    """Return the page about the arms.

    Args:
        listed: What `tvist robots --json` gives.
        command: The command that made the page, as it was typed.
    """
    measured = [{"name": one["name"], **found} for one in listed for found in one.get("measured", ())]
    return page(
        "robots", {"robots": listed}, command, arms=ARMS, measured=measured, measurements=MEASUREMENTS
    )
