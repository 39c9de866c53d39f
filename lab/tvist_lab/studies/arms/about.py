"""Describe an arm by its robot file, and say where the file's numbers come from."""

from typing import Any

from tvist_controller.api.line import calibrations, load_calibration
from tvist_lab.study.columns import Column, Entry
from tvist_plant.description import RobotDescription
from tvist_plant.robot_tables import ORIGINS
from tvist_plant.similar import stretched

SIZE = (
    Column("model", "model"), Column("joints", lambda one: len(one["joints"])), Column("length m", "length_m", 2),
    Column("payload kg", lambda one: f"{one['payload_kg']:g}"),
)  # fmt: skip
REDUCED = (
    Column("less % median", "reduction_percent.median", 1), Column("p5", "reduction_percent.p5", 1),
    Column("delay ms", "delay_ms", 0),
)  # fmt: skip


def _origin_of_drives(one: Entry) -> str:
    return next((kind for kind, told in one["origins"].items() if "drives" in told), "not told")


def frequencies(title: str) -> Column:
    """Return the column with the errors of a calibration's frequencies."""
    return Column(title, lambda one: ", ".join(f"{value:.1f}" for value in one["f_d_error_percent"]))


LISTED = (
    Column("name", "name"), *SIZE,
    Column("springs and drives", _origin_of_drives),
    Column("calibrations", lambda one: ", ".join(one["calibrations"]) or "–"),
)  # fmt: skip
RESULTS = (
    Column("name", "name"), Column("springs", lambda one: f"× {one['stiffness']:g}"),
    Column("calibration", "calibration"),
    frequencies("f_d off % 1, 2, 3"), Column("moves", "counted"), *REDUCED, Column("sag off %", "sag_error_percent", 2),
)  # fmt: skip


def about(name: str, description: RobotDescription) -> dict[str, Any]:
    """Describe an arm for `tvist robots --json`; `name` is the name or file with which it is served."""
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
