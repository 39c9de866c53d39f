"""The report of one recording, or of several with the same motions."""

import hashlib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from tvist_lab.figures.after_stop import compared_figure
from tvist_lab.figures.ring_down import ring_down_figure
from tvist_lab.figures.style import literal
from tvist_lab.metrics import (
    Comparison,
    Measured,
    NotMeasurableError,
    compare,
    grouped_notes,
)
from tvist_lab.recordings import read
from tvist_lab.report.page import Page, PageTable, Picture, Section, picture
from tvist_lab.report.verdict import verdict_on_one, verdict_on_two
from tvist_lab.words import counted

COLUMNS = {
    "motion": "Number of the motion.",
    "start s": "Time of the log at which the motion starts; since the first row if the log has the time of day.",
    "stop s": "Time of the log at which its target, the shaped reference, stops.",
    "Δ ms": "Time by which shaping lengthens the reference.",
    "t_stb ms": "Time from first entering a band of 0.03 mm around the attained position until staying inside.",
    "t_cycle ms": "Time from the start until the tool stays inside that band.",
    "e_os mm": "Overshoot: largest distance from the attained position after first entering the band.",
    "RV m/s²": "Residual vibration: an exponential fitted to the peaks of 0.3 s after the stop, at the stop.",
    "still after ms": "Last time the tool's acceleration exceeds 0.1 m/s², from the start of the motion.",
    "peak m/s²": "Largest acceleration of the tool after the stop and the declared delay.",
    "f_d Hz": "Damped frequency of the strongest mode after the stop, with its 95 % interval.",
    "ζ": "Damping ratio of that mode, with its 95 % interval.",
}
"""Columns of the table of motions, and what they mean."""
PICTURES = 6
"""Largest number of motions that are drawn."""


@dataclass(frozen=True)
class _File:
    path: Path
    name: str
    measured: Measured


def recordings_page(paths: Sequence[Path], command: str, columns: str | None = None) -> Page:
    """Build the report of recordings or logs; the first one is what the others are compared with.

    Args:
        paths: Files of any format that `tvist_lab.recordings.read` reads, at least one.
        command: The command that makes the report, for its provenance.
        columns: Names of the columns of a CSV, as `read` takes them.

    Raises:
        RecordingError: A file cannot be read, or has no joint angles; the message names it.
    """
    files = _files(paths, columns)
    base, *others = files
    compared = [(other, compare(base.measured, other.measured)) for other in others]
    sections = [Section("Motions", tables=[_table(file) for file in files])]
    if compared:
        sections.append(Section("Comparison", tables=[_changes(base, *pair) for pair in compared]))
    sections.append(
        Section("Vibration after the stop", pictures=list(_pictures(files, [c for _, c in compared])))
    )
    if missing := _missing(files):
        sections.append(Section("What could not be measured, and why", points=missing))
    sections.append(Section("What the columns mean", facts=COLUMNS))
    sections += [Section(f"Provenance of {file.name}", facts=_provenance(file)) for file in files]
    sections.append(Section("This report", facts={"Command": command}))
    title = f"Vibration of {' and '.join(file.name for file in files)}"
    return Page(title, _verdict(base, compared), sections)


def recordings_verdict(paths: Sequence[Path]) -> list[str]:
    """Return the sentences of the report's verdict, without its tables and figures.

    Raises:
        RecordingError: A file cannot be read, or has no joint angles; the message names it.
    """
    base, *others = _files(paths)
    return _verdict(base, [(other, compare(base.measured, other.measured)) for other in others])


def _verdict(base: _File, compared: Sequence[tuple[_File, Comparison]]) -> list[str]:
    if not compared:
        return verdict_on_one(base.measured.results, base.name)
    sentences: list[str] = []
    for other, comparison in compared:
        names = (base.name, other.name)
        sentences += verdict_on_two(comparison, base.measured.results, other.measured.results, names)
    return list(dict.fromkeys(sentences))


def _files(paths: Sequence[Path], columns: str | None = None) -> list[_File]:
    return [
        _File(path, name, Measured.of(read(path, columns)))
        for path, name in zip(paths, _names(paths), strict=True)
    ]


def _names(paths: Sequence[Path]) -> list[str]:
    """Names of the files; with their folders where two are equal."""
    names = [path.name or str(path) for path in paths]
    return [str(path) if names.count(name) > 1 else name for path, name in zip(paths, names, strict=True)]


def _table(file: _File) -> PageTable:
    rows = [
        (
            str(index),
            f"{result.start_s - file.measured.recording.origin:.3f}",
            f"{result.stop_s - file.measured.recording.origin:.3f}",
            _text(result.delay_ms, 0),
            _text(result.stabilisation_ms, 0),
            _text(result.cycle_ms, 0),
            _text(None if result.overshoot_m is None else 1e3 * result.overshoot_m, 3),
            _text(result.residual_vibration_m_s2, 2),
            _text(result.still_after_ms, 0),
            _text(result.peak_m_s2, 2),
            _text(result.f_d_hz, 2, result.f_d_interval_hz),
            _text(result.zeta, 3, result.zeta_interval),
        )
        for index, result in enumerate(file.measured.results, 1)
    ]
    return PageTable(tuple(COLUMNS), rows, file.name)


def _text(value: float | None, digits: int, interval: tuple[float, float] | None = None) -> str:
    if value is None:
        return "–"
    text = f"{value:.{digits}f}"
    return text if interval is None else f"{text} ({interval[0]:.{digits}f}–{interval[1]:.{digits}f})"


def _changes(base: _File, other: _File, comparison: Comparison) -> PageTable:
    rows = [
        (
            f"{one.a} and {one.b}",
            *(
                "–" if change is None else f"{round(change):+d} %"
                for change in (
                    one.impact_percent[name]
                    for name in (
                        "residual_vibration",
                        "peak",
                        "still_after",
                        "stabilisation",
                        "cycle",
                        "overshoot",
                    )
                )
            ),
        )
        for one in comparison.motions
    ]
    for numbers, name in ((comparison.only_in_a, base.name), (comparison.only_in_b, other.name)):
        rows += [(f"{number}, only in {name}", *["–"] * 6) for number in numbers]
    columns = ("motions", "RV", "peak", "still after", "t_stb", "t_cycle", "e_os")
    return PageTable(columns, rows, f"From {base.name} to {other.name}")


def _pictures(files: Sequence[_File], comparisons: Sequence[Comparison]) -> Iterator[Picture]:
    """One picture for each of the first motions, and one for each file of how its loudest motion rings."""
    base = files[0]
    for index, motion in list(enumerate(base.measured.motions, 1))[:PICTURES]:
        curves = [(literal(base.name), (base.measured.recording, motion))]
        for file, comparison in zip(files[1:], comparisons, strict=True):
            partner = next((one.b for one in comparison.motions if one.a == index), None)
            if partner is not None:
                curves.append(
                    (literal(file.name), (file.measured.recording, file.measured.motions[partner - 1]))
                )
        try:
            figure = compared_figure(f"Motion {index}", curves[:8])
        except NotMeasurableError:
            continue
        yield picture(figure, f"Acceleration of the tool around the stop of motion {index}, without gravity.")
    for file in files:
        loudest = max(enumerate(file.measured.results), key=lambda one: one[1].peak_m_s2 or 0.0, default=None)
        if loudest is None or loudest[1].peak_m_s2 is None:
            continue
        index = loudest[0]
        try:
            figure = ring_down_figure(
                f"{literal(file.name)}, motion {index + 1}",
                (file.measured.recording, file.measured.motions[index]),
            )
        except NotMeasurableError:
            continue
        caption = (
            f"How the tool rings after motion {index + 1} of {file.name}: course, spectrum and spectrogram."
        )
        yield picture(figure, caption)


def _missing(files: Sequence[_File]) -> list[str]:
    """What could not be measured or is not drawn, each with its reason."""
    items = []
    for file in files:
        items += [f"{file.name}, {note}" for note in grouped_notes(file.measured.results)]
        if len(file.measured.motions) > PICTURES:
            items.append(
                f"{file.name}: only the first {PICTURES} of {len(file.measured.motions)} motions are drawn"
            )
    return items


def _provenance(file: _File) -> Mapping[str, str]:
    recording = file.measured.recording
    facts = {"File": str(file.path)}
    if file.path.is_file():
        with file.path.open("rb") as stream:
            facts["SHA-256"] = hashlib.file_digest(stream, "sha256").hexdigest()
        facts["Size"] = f"{file.path.stat().st_size} bytes"
    facts["Rows"] = (
        f"{len(recording)}, one every {1e3 * recording.period:g} ms, from {recording.time[0]:.3f} to "
        f"{recording.time[-1]:.3f} s; {recording.missing_ticks} are missing"
    )
    info = recording.info
    if info is not None:
        payload = info.payload
        facts |= {
            "Robot": f"{info.name}, model {info.model}, tvist {info.version}",
            "Shaper when the recording began": f"{info.shaper}, {counted(info.modes, 'mode')}",
            "Declared payload": f"{payload.mass:g} kg",
        }
    if recording.foreign:
        facts["Recorded by"] = "another controller; gravity is what the sensor shows at rest"
    facts["Columns"] = ", ".join(sorted(recording.columns))
    if recording.notes:
        facts["Left out when reading"] = "; ".join(recording.notes)
    return facts
