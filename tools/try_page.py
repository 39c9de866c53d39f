"""`python -m tools.try_page`: writes what the page for trying shaping takes from the packages, and what checks it.

In `view/page/try/made`, `taken.json` becomes part of the page: the catalogue's rows, the arm with one flexible joint,
and a UR5e's motion from Q1 to Q3. `checked.json` has numbers of the packages, which a test compares with those of the
page. Runs in a checkout; `make page` builds the page.
"""

import asyncio
import json
from pathlib import Path
from typing import Any

import numpy as np

from tools.one_mass import swing
from tvist_controller.api.line import DrivenLine, respond
from tvist_lab.compared import run_beside
from tvist_lab.one_joint.closed_form import FlexibleShoulder
from tvist_lab.study.line import PAPER, RESTING, Unchanged, point_to_point
from tvist_plant.description import load
from tvist_plant.flexible_arm import SUBSTEPS_OF_A_PERIOD, FlexibleArm
from tvist_plant.plant import PERIOD
from tvist_plant.sensors import gear_phases
from tvist_shaping import Estimator, Fixed, TvistFilter, residual, shaper
from tvist_shaping.catalogue import SHAPERS
from tvist_view.look import Look
from tvist_view.signals import MOVING, moves
from tvist_view.track import Shown, Track

MADE = Path(__file__).parents[1] / "view" / "page" / "try" / "made"
MODES = ((1.0, 0.0), (6.7, 0.034), (14.3, 0.11), (4.2, 0.19))
"""Modes at which every shaper is compared: f_d [Hz] and ζ [-], within the range of all."""
RATIOS = (0.5, 0.8, 0.93, 1.0, 1.1, 1.37)
"""True frequencies over assumed ones at which the residual is compared [-]."""
AFTER = 350
"""Ticks at rest at the end of a motion of the arm."""
EVERY = 10
"""Ticks of a motion between two that are kept."""
MOTIONS = (
    ("none", "following", (-1.3, 2.6), (0.0, 0.52)),
    ("zv", "following", (-1.3, 2.6), (0.0, 0.52)),
    ("zv", "fixed", (0.4, 0.5), (-0.7, 2.4)),
    ("ei", "following", (0.0, 2.6), (1.0, 1.57)),
    ("um_zv", "following", (0.2, 1.0), (0.25, 0.9)),
)
"""Shaper, estimator, and the angles at which a motion begins and ends [rad]."""


def taken() -> dict[str, Any]:
    """What becomes part of the page."""
    rows = [{"name": row.name, "zeta_max": row.zeta_max} for row in SHAPERS.values()]
    return {"catalogue": rows, "arm": _arm(), "ur5e": _ur5e()}


def _arm() -> dict[str, Any]:
    """Parameters of the arm with one flexible joint, as `arm.ts` names them."""
    description = load("one-joint")
    drives, shoulder = description.drives, FlexibleShoulder.of(description, description.payload)
    links, payload = description.links, description.payload
    (_, length), (_, com) = description.kinematics.a, (row[0] for row in links.com)
    forearm = links.inertia[1][5] + links.mass[1] * (length + com) ** 2
    forearm += payload.inertia[5] + payload.mass * (length + payload.com[0]) ** 2
    named = (
        "gear_stiffness", "gear_damping", "rotor_inertia", "velocity_gain", "position_gain", "integral_gain",
        "coulomb_friction", "friction_width", "friction_feedforward", "friction_feedforward_width",
        "gear_error_amplitude", "gear_error_waves",
    )  # fmt: skip
    limits = {"velocity": PAPER.velocity, "acceleration": PAPER.acceleration, "jerk": PAPER.jerk}
    return {
        "middle": shoulder.middle,
        "change": shoulder.change,
        "forearm": forearm,
        "lengths": description.kinematics.a,
        **{name: getattr(drives, name) for name in named},
        "gear_phase": gear_phases(2, 0).tolist(),
        "period": PERIOD,
        "substeps": SUBSTEPS_OF_A_PERIOD,
        "limits": limits,
    }


def _ur5e() -> dict[str, Any]:
    """The motion from Q1 to Q3, without a shaper and with ZV that follows the arm's frequency."""
    poses = load("ur5e").poses
    tracks = []
    for name, label in (("none", "unshaped"), ("zv", "shaped")):
        info, run = asyncio.run(run_beside(name, [poses["Q1"], poses["Q3"]]))
        assert info.geometry is not None  # of our own server
        tracks.append(Track(Shown(label, Look(info.geometry, info.payload)), run.states, run.truths))
    span = moves(tracks[0].signals)
    assert span is not None  # it is a motion of ours
    start, stop = span[0] - 0.1, span[1]
    packed = [track.packed(start) for track in tracks]
    for one in packed:
        one["samples"] = {name: one["samples"][name] for name in ("time", "alpha")}
    return {
        "tracks": packed,
        "left": [_largest_after_stop(track) for track in tracks],
        "stop": stop - start,
    }


def _largest_after_stop(track: Track) -> float:
    """Largest acceleration of the tool once the shaped reference has come to rest [m/s²]."""
    signals = track.signals
    moving = np.flatnonzero(signals.acceleration > MOVING)
    return float(np.nan_to_num(signals.alpha[moving[-1] + 5 :]).max(initial=0.0))


def checked() -> dict[str, Any]:
    """Numbers of the packages by which the page's are checked."""
    return {
        "shapers": {name: [_of_shaper(name, *mode) for mode in MODES] for name in SHAPERS},
        "bands": {name: _band(name) for name in SHAPERS},
        "filter": _filtered(),
        "swing": _swing(),
        "motions": [_motion(*motion) for motion in MOTIONS],
    }


def _of_shaper(name: str, f_d: float, zeta: float) -> dict[str, Any]:
    made = SHAPERS[name].impulses(f_d, zeta)
    true = f_d * np.array(RATIOS)
    return {
        "mode": [f_d, zeta], "A": made.A.tolist(), "tau": made.tau.tolist(),
        "f": true.tolist(), "residual": residual(true, zeta, made).tolist(),
    }  # fmt: skip


def _band(name: str) -> list[float | str]:
    """Band of 5 % without damping, in design frequencies; what is not finite as a word."""
    return [end if np.isfinite(end) else str(end) for end in SHAPERS[name].band(0.05)]


def _filtered() -> dict[str, Any]:
    """Samples of two joints, shaped by a filter whose mode follows them."""
    description = load("one-joint")
    estimator = FlexibleShoulder.of(description, description.payload).estimator()
    tvist = TvistFilter(shaper("zvd"), estimator, joints=2)
    tvist.reset([0.1, 2.5])
    time = np.linspace(0.0, 1.0, 200)
    samples = np.stack([0.1 + np.sin(3.0 * time), 2.5 - 2.0 * time**2], axis=1)
    return {
        "samples": samples.tolist(),
        "shaped": [tvist.filter(sample).tolist() for sample in samples],
    }


def _swing() -> dict[str, Any]:
    one = swing(4.3, 0.05, (5.0, 0.05))
    return {
        "mode": [4.3, 0.05], "believed": [5.0, 0.05],
        "reference": one.reference[::EVERY].tolist(), "deflection": one.deflection[::EVERY].tolist(),
    }  # fmt: skip


def _motion(
    name: str, estimator: str, start: tuple[float, float], target: tuple[float, float]
) -> dict[str, Any]:
    """One motion of the simulated arm, to the accuracy of a number in JSON."""
    description = load("one-joint")
    arm = FlexibleArm(description, description.payload)
    formula = FlexibleShoulder.of(description, description.payload)
    f_d, zeta = formula.mode(float(np.pi / 2.0))
    mode: Estimator = formula.estimator() if estimator == "following" else Fixed([f_d], [zeta])
    tvist = TvistFilter(shaper(name), mode, joints=2)
    tvist.reset(start)
    reference = point_to_point(np.array(start), np.array(target))
    rest = np.tile(reference[-1], (AFTER, 1))
    shaped = tvist.filter_all(np.concatenate([reference, rest]))
    line = DrivenLine(description, Unchanged(2), np.array(start), description.payload)
    link = respond(arm, line.drive(np.array(start), shaped, RESTING + len(shaped), RESTING), 0).measured.q
    return {
        "shaper": name, "estimator": estimator, "start": start, "target": target, "resting": RESTING,
        "link": link[::EVERY].tolist(),
    }  # fmt: skip


def main() -> None:
    """Write both files."""
    MADE.mkdir(exist_ok=True)
    for name, content in (("taken", taken()), ("checked", checked())):
        path = MADE / f"{name}.json"
        path.write_text(json.dumps(content, separators=(",", ":")) + "\n", encoding="utf-8")
        print(f"{path}: {path.stat().st_size / 1e3:.0f} kB")


if __name__ == "__main__":
    main()
