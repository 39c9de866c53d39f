"""What a robot file says of an arm and where its numbers come from; and the page about all arms."""

from typing import Any

from tvist_controller.api.line import calibrations, load_calibration
from tvist_lab.studies.pages import page
from tvist_lab.study.tables import Entry, Shown
from tvist_plant.description import RobotDescription
from tvist_plant.robot_tables import ORIGINS
from tvist_plant.similar import stretched

_SIZE = (
    Shown("model", "model"), Shown("joints", lambda one: len(one["joints"])), Shown("length m", "length_m", 2),
    Shown("payload kg", lambda one: f"{one['payload_kg']:g}"),
)  # fmt: skip
_REDUCED = (
    Shown("less % median", "reduction_percent.median", 1), Shown("p5", "reduction_percent.p5", 1),
    Shown("delay ms", "delay_ms", 0),
)  # fmt: skip


def _origin_of_drives(one: Entry) -> str:
    return next((kind for kind, told in one["origins"].items() if "drives" in told), "not told")


def _frequencies(title: str) -> Shown:
    return Shown(title, lambda one: ", ".join(f"{value:.1f}" for value in one["f_d_error_percent"]))


ARMS = (
    Shown("name", lambda one: f"`{one['name']}`"), *_SIZE,
    Shown("largest torques N m", lambda one: ", ".join(f"{torque:g}" for torque in one["torque_n_m"])),
    Shown("calibrations", lambda one: ", ".join(one["calibrations"])),
)  # fmt: skip
"""Columns of the page's table of arms, and of the terminal's."""
LISTED = (
    Shown("name", "name"), *_SIZE,
    Shown("springs and drives", _origin_of_drives),
    Shown("calibrations", lambda one: ", ".join(one["calibrations"]) or "–"),
)  # fmt: skip
MEASUREMENTS = (
    Shown("arm", lambda one: f"`{one['name']}`"),
    Shown("springs", lambda one: f"{100.0 * (one['stiffness'] - 1.0):+.0f} %"), Shown("calibration", "calibration"),
    _frequencies("f_d off by %"), Shown("moves", "counted"), Shown("too weak", "too_weak"), *_REDUCED,
    Shown("sag off by %", "sag_error_percent", 2),
)  # fmt: skip
"""Columns of the page's table of measurements, and of the terminal's."""
RESULTS = (
    Shown("name", "name"), Shown("springs", lambda one: f"× {one['stiffness']:g}"), Shown("calibration", "calibration"),
    _frequencies("f_d off % 1, 2, 3"), Shown("moves", "counted"), *_REDUCED, Shown("sag off %", "sag_error_percent", 2),
)  # fmt: skip


def about(name: str, description: RobotDescription) -> dict[str, Any]:
    """Return an arm as `tvist robots --json` describes it.

    Args:
        name: Name or file by which the arm is served.
        description: The arm.
    """
    limits, drives = description.limits, description.drives
    known = [load_calibration(name) for name in calibrations()]
    return {
        "name": name,
        "model": description.robot.model,
        "joints": list(description.robot.joints),
        "length_m": stretched(description.kinematics),
        "payload_kg": limits.payload,
        "torque_n_m": list(limits.torque),
        "velocity_rad_s": list(limits.velocity),
        "gear_stiffness_n_m_rad": list(drives.gear_stiffness),
        "bending_stiffness_n_m_rad": dict(
            zip(
                (description.robot.joints[link] for link in description.link_flexibility.links),
                description.link_flexibility.stiffness,
                strict=True,
            )
        ),
        "collision_bodies": len(description.collision.bodies),
        "origins": {
            kind: {
                key: origin.partition(":")[2].strip()
                for key, origin in description.provenance.items()
                if origin.startswith(kind)
            }
            for kind in ORIGINS
        },
        "calibrations": [one.name for one in known if one.robot == description.robot.model],
    }


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
