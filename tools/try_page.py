"""`python -m tools.try_page`: write the data that the interactive shaping page takes from the packages.

`view/page/try/made/taken.json` becomes part of the page: the catalogue's rows, the arm with one flexible
joint, and a UR5e's motion from Q1 to Q3. Run it in a checkout; `make page` builds the page.
"""

import asyncio
import json
from pathlib import Path
from typing import Any

import numpy as np

from tvist_lab.in_process import run_beside
from tvist_lab.one_joint import FlexibleShoulder
from tvist_lab.study.line import PAPER
from tvist_plant.description import load
from tvist_plant.flexible_arm import SUBSTEPS_OF_A_PERIOD
from tvist_plant.plant import PERIOD
from tvist_plant.sensors import gear_phases
from tvist_shaping.catalogue import SHAPERS
from tvist_view.look import Look
from tvist_view.signals import MOVING, moves
from tvist_view.track import Track

TAKEN = Path(__file__).parents[1] / "view" / "page" / "try" / "made" / "taken.json"


def taken() -> dict[str, Any]:
    """Return the data of the page."""
    rows = [{"name": row.name, "zeta_max": row.zeta_max} for row in SHAPERS.values()]
    return {"catalogue": rows, "arm": _arm(), "ur5e": _ur5e()}


def _arm() -> dict[str, Any]:
    """Return parameters of the arm with one flexible joint, with the names of `arm.ts`."""
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
    return {
        "middle": shoulder.middle,
        "change": shoulder.change,
        "forearm": forearm,
        "lengths": description.kinematics.a,
        **{name: getattr(drives, name) for name in named},
        "gear_phase": gear_phases(2, 0).tolist(),
        "period": PERIOD,
        "substeps": SUBSTEPS_OF_A_PERIOD,
        "limits": {"velocity": PAPER.velocity, "acceleration": PAPER.acceleration, "jerk": PAPER.jerk},
    }


def _ur5e() -> dict[str, Any]:
    """Return the motion from Q1 to Q3, without a shaper and with ZV that follows the arm's frequency."""
    poses = load("ur5e").poses
    tracks, left = [], []
    for name, label in (("none", "unshaped"), ("zv", "shaped")):
        info, run = asyncio.run(run_beside(name, [poses["Q1"], poses["Q3"]]))
        assert info.geometry is not None  # this version's server sends it
        track = Track(label, Look(info.geometry, info.payload), run.states, run.truths)
        tracks.append(track)
        moving = np.flatnonzero(track.signals.acceleration > MOVING)
        rest = track.signals.alpha[moving[-1] + 5 :]  # from 10 ms after the shaped reference's stop
        left.append(float(np.nan_to_num(rest).max(initial=0.0)))
    span = moves(tracks[0].signals)
    assert span is not None  # the arm has moved
    start, stop = span[0] - 0.1, span[1]
    packed = [track.packed(start) for track in tracks]
    for one in packed:
        one["samples"] = {name: one["samples"][name] for name in ("time", "alpha")}
    return {"tracks": packed, "left": left, "stop": stop - start}


def main() -> None:
    """Write the file."""
    TAKEN.parent.mkdir(exist_ok=True)
    TAKEN.write_text(json.dumps(taken(), separators=(",", ":")) + "\n", encoding="utf-8")
    print(f"{TAKEN}: {TAKEN.stat().st_size / 1e3:.0f} kB")


if __name__ == "__main__":
    main()
