"""Express an advice as sentences, as the command that applies it, and as plain values."""

import math
from collections import Counter
from collections.abc import Sequence
from typing import Any

from tvist_lab.advice.advise import Advice
from tvist_lab.advice.options import ANY, EACH, ROBOT, Option
from tvist_lab.metrics import MeasuredRecording
from tvist_lab.phrases import counted, spread

NEVER = "ring longer than the recorded rest"
NAMED = 3  # largest number of modes that a sentence names


def verdict(advice: Advice, logs: Sequence[MeasuredRecording]) -> list[str]:
    """Return the advice and its reasons as sentences."""
    said = [_first(advice)]
    if advice.ringing:
        said.append(_ringing(advice))
    if advice.best is not None:
        said += _reasons(advice, advice.best)
    if advice.shaped:
        names = ", ".join(sorted({name for *_, name in advice.shaped if name})) or "a shaper"
        said.append(
            f"{counted(len(advice.shaped), 'motion')} made with {names} already: not counted as unshaped."
        )
    untold = any(log.recording.foreign and "reference_q" not in log.recording for log in logs)
    if advice.best is not None and untold:
        said.append(
            "A log without the reference before shaping cannot show whether a shaper was on: it must have been off."
        )
    return said


def _first(advice: Advice) -> str:
    if (best := advice.best) is not None:
        aim, gain = "with its calibration", advice.still_s - best.still_s
        if best.aim.scope != ROBOT:
            worst = max(advice.ringing, key=lambda one: one.unshaped.rms)
            modes = (f"{f_d:.1f} Hz (ζ {zeta:.2f})" for f_d, zeta in best.aim.modes[worst.group])
            aim = f"against {' and '.join(modes)}"
        each = ", and the like before other motions" if best.aim.scope == EACH else ""
        sooner = ""
        if math.isfinite(gain) and abs(gain) >= 0.01:
            order = "earlier" if gain > 0.0 else "later"
            sooner = f", and the tool is still {abs(1e3 * gain):.0f} ms {order}"
        return (
            f"Use {best.shaper} {aim}{each}: it leaves {best.left_percent:.0f} % of the vibration after a stop"
            f"{sooner}, for motions that end {1e3 * best.added_s:.0f} ms later."
        )
    if advice.options:
        return "No shaper that keeps the arm's limits would help: change the motions or the mount."
    if advice.ringing:
        low, high = ANY
        return (
            f"No advice: what rings has no frequency that is known, or none from {low:g} to {high:g} Hz. Record longer "
            "rests, and each motion several times."
        )
    if advice.quiet:
        return f"Nothing to do: nothing rings noticeably after {counted(len(advice.quiet), 'unshaped stop')}."
    if advice.shaped:
        return "No advice: every motion had a shaper already. Record the same motions without one."
    return _unmeasured(advice)


def _unmeasured(advice: Advice) -> str:
    if advice.weak is not None:
        f_d, count = advice.weak
        return (
            f"No advice: nothing felt the tool. After {counted(count, 'stop')} the joints swing at about {f_d:.1f} Hz, "
            "which is weak evidence: record the tool's acceleration."
        )
    why = Counter(reason for *_, reason in advice.refused).most_common(1)
    if not why:
        return "No advice: nothing moves in the log. Record motions with a second of rest after each."
    return f"No advice: no stop could be measured ({why[0][0]}). Record the tool's acceleration, and rests of a second."


def _ringing(advice: Advice) -> str:
    stills = [one.unshaped.still for one in advice.ringing]
    known = [1e3 * still for still in stills if math.isfinite(still)]
    many = counted(len(advice.ringing) + len(advice.quiet), "unshaped stop")
    modes = " and ".join(
        f"{one.f_d:.1f} Hz (ζ {one.zeta:.2f}, {one.motions} of them)" for one in advice.modes[:NAMED]
    )
    until = f", still {spread(known, 'ms')} after the stop" if known else ""
    later = f"; {len(stills) - len(known)} of them {NEVER}" if len(known) < len(stills) else ""
    rings = "rings" if len(advice.ringing) == 1 else "ring"
    return f"{len(advice.ringing)} of {many} {rings}{f' at {modes}' if modes else ''}{until}{later}."


def _reasons(advice: Advice, best: Option) -> list[str]:
    others = []
    if advice.smoothed_percent is not None:
        others.append(f"a reference smoothed over the same time would leave {advice.smoothed_percent:.0f} %")
    if advice.slowed_percent is not None:
        others.append(f"motions slowed by the same time {advice.slowed_percent:.0f} %, by the modes")
    said = [f"Instead of a shaper, {' and '.join(others)}."] if others else []
    if best.aim.optimistic:
        many = counted(len(best.aim.optimistic), "motion")
        alone = "is predicted from its" if len(best.aim.optimistic) == 1 else "are predicted from their"
        said.append(f"Without repetitions, {many} {alone} own modes, which is optimistic.")
    return said


def command(advice: Advice, logs: Sequence[MeasuredRecording]) -> list[str]:
    """Return the lines of code or commands that apply an advice; none if there is nothing to apply."""
    # A robot of this controller gets the shaper over the network; the reference of another robot goes through
    # the library.
    best = advice.best
    if best is None:
        return []
    if best.aim.scope == ROBOT and best.count == 1:
        return [f"tvist serve --shaper {best.shaper}"]
    set_shaper = f'await arm.set_shaper("{best.shaper}", modes={best.count})'
    if best.aim.scope == ROBOT:
        return [set_shaper]
    ours = not any(log.recording.foreign for log in logs)
    lines = []
    for group, modes in best.aim.modes.items():
        f_d, zeta = ([round(value, 3) for value in values] for values in zip(*modes, strict=True))
        if ours:
            lines.append(f'await arm.set_estimator("fixed", f_d={f_d}, zeta={zeta})')
        else:
            joints = logs[0].recording.joints
            lines.append(
                f'shaped = make_filter("{best.shaper}", Fixed(f_d={f_d}, zeta={zeta}), joints={joints})'
            )
        if best.aim.scope != EACH:
            break
        numbers = sorted({one.number for one in advice.ringing if one.group == group})
        lines[-1] += f"  # before motion {', '.join(map(str, numbers))}"
    return [*lines, set_shaper] if ours else ["from tvist_shaping import Fixed, make_filter", *lines]


def as_dict(advice: Advice, logs: Sequence[MeasuredRecording]) -> dict[str, Any]:
    """Convert an advice to plain values for `tvist log advise --json`."""
    return {
        "verdict": verdict(advice, logs),
        "command": command(advice, logs),
        "recommended": None if advice.best is None else _option(advice.best),
        "smoothed_percent": advice.smoothed_percent,
        "slowed_percent": advice.slowed_percent,
        "modes": [one._asdict() for one in advice.modes],
        "stops": [
            {"file": one.file, "motion": one.number, "same_motion": one.group, "rings": one in advice.ringing,
             "rms_m_s2": one.unshaped.rms, "still_s": _finite(one.unshaped.still)}
            for one in (*advice.ringing, *advice.quiet)
        ],
        "shaped": [dict(zip(("file", "motion", "shaper"), one, strict=True)) for one in advice.shaped],
        "refused": [dict(zip(("file", "motion", "reason"), one, strict=True)) for one in advice.refused],
        "weak_f_d_hz": None if advice.weak is None else advice.weak[0],
        "options": [_option(one) for one in advice.options],
    }  # fmt: skip


def _option(one: Option) -> dict[str, Any]:
    return {
        "shaper": one.shaper, "modes": one.count, "aim": one.aim.scope, "keeps_limits": one.keeps_limits,
        "added_s": one.added_s, "left_percent": one.left_percent, "left_by_modes_percent": one.modes_percent,
        "still_s": _finite(one.still_s), "optimistic": len(one.aim.optimistic),
        "aimed_at": {str(group): [list(mode) for mode in modes] for group, modes in one.aim.modes.items()},
        "motions": [
            {"file": stop.file, "motion": stop.number, "left_percent": percent}
            for stop, percent in one.percent.items()
        ],
    }  # fmt: skip


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None
