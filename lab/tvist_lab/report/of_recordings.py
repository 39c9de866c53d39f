"""The web page of one recording, or of several with the same motions."""

import hashlib
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from tvist_lab.figures.after_stop import ComparedPanel, compared_figure, ring_down_figure
from tvist_lab.figures.sheets import house_style
from tvist_lab.figures.style import SERIES, literal
from tvist_lab.metrics import (
    COLUMNS,
    Comparison,
    MeasuredRecording,
    MotionPair,
    NotMeasurableError,
    changes,
    compare,
    grouped_notes,
    motion_cells,
    pairs,
)
from tvist_lab.metrics.columns import number, percent
from tvist_lab.phrases import counted
from tvist_lab.recordings import Recording, read
from tvist_lab.recordings.mcap_records import files_of
from tvist_lab.report.page import PageTable, Picture, ReportPage, Section, picture
from tvist_lab.report.verdict import shaping_of, verdict_on_one, verdict_on_pairs, verdict_on_two

PAIRED = ("motion", "shaper", "without\nm/s²", "with\nm/s²", "less\n%", "at rest\nms earlier", "longer\nΔ ms")
"""Columns of the table of motions that were made without and with a shaper."""
CHANGES = {
    "vibration\nRV": "residual_vibration", "peak": "peak", "at rest": "still_after", "settling\nt_stb": "stabilisation",
    "cycle\nt_cycle": "cycle", "overshoot\ne_os": "overshoot",
}  # fmt: skip
"""Columns of the table that compares two files, and the change that each column shows."""
OF_PAIRS = {
    "without": "Largest acceleration of the tool after the unshaped motion, later than 10 ms after its stop.",
    "with": "The same after the shaped motion.",
    "less": "By how much it is less.",
}  # meaning of columns that the table of motions does not explain
WITHOUT = "without a shaper"
PICTURES = 6  # largest number of motions in the figures


@dataclass(frozen=True)
class _File:
    path: Path
    name: str
    measured: MeasuredRecording
    pairs: Sequence[MotionPair]


@house_style()
def recordings_page(
    paths: Sequence[Path], command: str, recordings: Sequence[Recording] | None = None
) -> ReportPage:
    """Build the report of recordings or logs; the others are compared with the first.

    `command` is for the provenance.
    """
    files = _files(paths, recordings)
    base, *others = files
    compared = [(other, compare(base.measured, other.measured)) for other in others]
    paired = [_pairs(file) for file in files if file.pairs]
    sections = [Section("Without and with a shaper", tables=paired)] if paired else []
    if compared:
        sections.append(Section("Comparison", tables=[_changes(base, *pair) for pair in compared]))
    panels = _panels(files, [comparison for _, comparison in compared])
    sections.append(Section("Vibration after the stop", pictures=list(_pictures(files, panels))))
    measured = [(file.measured, file.name) for file in files]
    cells = ((motion_cells(one.results, one.recording.origin), name) for one, name in measured)
    sections.append(Section("Motions", tables=[PageTable(tuple(COLUMNS), *own) for own in cells]))
    if missing := _missing(files, panels):
        sections.append(Section("What could not be measured, and why", points=missing))
    meanings = COLUMNS | (OF_PAIRS if paired else {})
    sections.append(Section("What the columns mean", facts=meanings, explains=True))
    sections += [Section(f"Provenance of {file.name}", facts=_provenance(file)) for file in files]
    sections.append(Section("This report", facts={"Command": command}))
    title = f"Vibration of {' and '.join(file.name for file in files)}"
    return ReportPage(title, _verdict(base, compared), sections)


def _verdict(base: _File, compared: Sequence[tuple[_File, Comparison]]) -> list[str]:
    if not compared:
        results = base.measured.results
        changed = changes(base.measured)
        if base.pairs:
            return verdict_on_pairs(base.pairs, results, base.name) + changed
        return verdict_on_one(results, base.name) + changed
    sentences: list[str] = []
    for other, comparison in compared:
        names = (base.name, other.name)
        sentences += verdict_on_two(comparison, base.measured.results, other.measured.results, names)
    files = [base, *(other for other, _ in compared)]
    sentences += [f"{file.name}: {one}" for file in files for one in changes(file.measured)]
    return list(dict.fromkeys(sentences))


def _files(paths: Sequence[Path], recordings: Sequence[Recording] | None = None) -> list[_File]:
    found = []
    for path, name, recording in zip(paths, _names(paths), recordings or map(read, paths), strict=True):
        measured = MeasuredRecording.of(recording)
        found.append(_File(path, name, measured, pairs(measured)))
    return found


def _names(paths: Sequence[Path]) -> list[str]:
    """Return the names of the files, with their folders if two are equal."""
    names = [path.name or str(path) for path in paths]
    return [str(path) if names.count(name) > 1 else name for path, name in zip(paths, names, strict=True)]


def _pairs(file: _File) -> PageTable:
    """Return the table of the changes by shaping for each motion."""
    rows = [
        (
            f"{one.name}\n{one.unshaped + 1} and {one.shaped + 1}",
            one.shaper or "–",
            number(one.change.before, 3),
            number(one.change.after, 3),
            number(one.change.less_percent, 0),
            number(one.change.gain_ms, 0),
            number(file.measured.results[one.shaped].delay_ms, 0),
        )
        for one in file.pairs
    ]
    return PageTable(PAIRED, rows, file.name)


def _changes(base: _File, other: _File, comparison: Comparison) -> PageTable:
    rows = [
        (f"{one.a} and {one.b}", *(percent(one.impact_percent[name]) for name in CHANGES.values()))
        for one in comparison.motions
    ]
    for numbers, name in ((comparison.only_in_a, base.name), (comparison.only_in_b, other.name)):
        rows += [(f"{number}, only in {name}", *["–"] * len(CHANGES)) for number in numbers]
    return PageTable(("motions", *CHANGES), rows, f"From {base.name} to {other.name}")


def _panels(files: Sequence[_File], comparisons: Sequence[Comparison]) -> list[ComparedPanel]:
    """Choose the curves of each panel: with and without shapers in one file, or corresponding motions of several."""
    base, *others = files
    recording, found = base.measured.recording, base.measured.motions
    shown = []
    partners = {one.shaped for one in base.pairs}
    for place, motion in enumerate(found):
        mine = [one for one in base.pairs if one.unshaped == place]
        curves = {literal(base.name): (recording, motion)}
        name, said = f"Motion {place + 1}", ""
        if others:
            for file, comparison in zip(others, comparisons, strict=True):
                for partner in (one.b for one in comparison.motions if one.a == place + 1):
                    curves[literal(file.name)] = (file.measured.recording, file.measured.motions[partner - 1])
        elif mine:
            name = mine[0].name
            curves = {WITHOUT: (recording, motion)}
            curves |= {f"with {one.shaper or 'the shaper'}": (recording, found[one.shaped]) for one in mine}
            said = mine[0].change.less() if len(mine) == 1 else ""
        elif place in partners:
            continue
        shown.append(ComparedPanel(name[0].upper() + name[1:], curves, said))
    return shown


def _pictures(files: Sequence[_File], panels: Sequence[ComparedPanel]) -> Iterator[Picture]:
    """Yield a picture of the first motions, on one scale, and one of the strongest ring-down of each file."""
    plain = [file.name for file in files if shaping_of(file.measured.results, file.name).shaped is False]
    unshaped = [WITHOUT, *map(literal, plain)]
    with suppress(NotMeasurableError):
        caption = "Acceleration of the tool around the stop, without gravity; all panels have one scale."
        yield picture(compared_figure(panels[:PICTURES], unshaped), caption)
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


def _missing(files: Sequence[_File], panels: Sequence[ComparedPanel]) -> list[str]:
    """Return what could not be measured or drawn, with the reasons."""
    items = [f"{file.name}, {note}" for file in files for note in grouped_notes(file.measured.results)]
    if len(panels) > PICTURES:
        items.append(f"{files[0].name}: only the first {PICTURES} of {len(panels)} motions are drawn")
    if (curves := len({name for one in panels for name in one.curves})) > len(SERIES):
        items.append(f"only the first {len(SERIES)} of {curves} curves are drawn")
    return items


def _sha256(path: Path) -> str:
    with path.open("rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()


def _provenance(file: _File) -> Mapping[str, str]:
    recording = file.measured.recording
    facts = {"File": str(file.path)}
    there = [place for place in files_of(file.path) if place.is_file()]
    if there:
        facts["SHA-256"] = ", ".join(map(_sha256, there))
        facts["Size"] = f"{sum(place.stat().st_size for place in there)} bytes"
    facts["Rows"] = (
        f"{len(recording)}, one every {1e3 * recording.period:g} ms, from {recording.time[0]:.3f} to "
        f"{recording.time[-1]:.3f} s; {recording.missing_ticks} are missing"
    )
    info = recording.info
    if info is not None:
        facts |= {
            "Robot": f"{info.name}, model {info.model}, tvist {info.version}",
            "Shaper when the recording began": f"{info.shaper}, {counted(info.modes, 'mode')}",
            "Declared payload": f"{info.payload.mass:g} kg",
        }
    if recording.foreign:
        facts["Recorded by"] = "another controller; gravity is what the sensor shows at rest"
    facts["Columns"] = ", ".join(sorted(recording.columns))
    if recording.notes:
        facts["Left out when reading"] = "; ".join(recording.notes)
    return facts
