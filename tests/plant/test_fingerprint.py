"""The fingerprint of an arm changes with what makes it vibrate, and with nothing else."""

from pathlib import Path

import msgspec
import pytest

from tvist_plant.description import RobotDescription, fingerprint, load

UR5E = load("ur5e")
REPLACE = msgspec.structs.replace


def changed(table: str, **values) -> RobotDescription:
    return REPLACE(UR5E, **{table: REPLACE(getattr(UR5E, table), **values)})


def scaled(table: str, key: str, factor: float = 1.001) -> RobotDescription:
    values = getattr(getattr(UR5E, table), key)
    return changed(table, **{key: (values[0] * factor, *values[1:])})


@pytest.mark.parametrize(
    "description",
    [
        scaled("drives", "gear_stiffness"),
        scaled("drives", "gear_damping"),
        scaled("drives", "rotor_inertia"),
        scaled("drives", "velocity_gain"),
        scaled("drives", "position_gain"),
        scaled("drives", "integral_gain"),
        scaled("drives", "coulomb_friction"),
        scaled("links", "mass"),
        scaled("link_flexibility", "stiffness"),
        changed("link_flexibility", links=(), stiffness=()),
        changed("kinematics", a=(0.0, -0.5, -0.4, 0.0, 0.0, 0.0)),
    ],
)
def test_another_arm_has_another_one(description):
    assert fingerprint(description) != fingerprint(UR5E)


@pytest.mark.parametrize(
    "description",
    [
        changed("robot", name="left", model="Other"),
        scaled("limits", "position"),
        scaled("limits", "torque"),
        changed("payload", mass=1.0),
        changed("sensors", accelerometer_noise=1.0),
        changed("drives", gear_error_amplitude=0.0),
        changed("drives", friction_feedforward=0.0),
        REPLACE(UR5E, poses={}),
        UR5E.clean(),
        UR5E.quiet(),
    ],
)
def test_the_same_arm_under_another_name_with_other_limits_has_the_same(description):
    assert fingerprint(description) == fingerprint(UR5E)


def test_a_number_written_another_way_is_the_same_number(tmp_path: Path):
    import tvist_plant

    text = (Path(tvist_plant.__file__).parent / "robots" / "ur5e.toml").read_text(encoding="utf-8")
    written = text.replace("27500.0", "2.75e4").replace("[1.2, 1.2,", "[1.20, 1.2,")
    assert written != text
    path = tmp_path / "same.toml"
    path.write_text(written, encoding="utf-8")
    assert fingerprint(load(path)) == fingerprint(UR5E)
