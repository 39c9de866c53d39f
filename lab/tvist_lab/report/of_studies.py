"""The web page of a study: verdict, tables, figures and explanations."""

from tvist_lab.figures import study_figure
from tvist_lab.phrases import QUANTILES_FROM, counted
from tvist_lab.report.page import PageTable, ReportPage, Section, picture
from tvist_lab.study.columns import ResultTable, cells, meanings, titles
from tvist_lab.study.study import Figures, Result

LISTED = 200  # largest number of motions that are listed


def study_figures(result: Result) -> Figures:
    """Return the figures of a study."""
    study, summary = result.study, result.values["summary"]
    if study.draw is not None:
        return study.draw(result)
    few = any(entry["rows"] < QUANTILES_FROM for entry in summary)
    caption = "The least and the most." if few else "Medians, and bands from the 5th to the 95th percentile."
    return {"study": (study_figure(summary, study.by, study.show, few=few), caption)}


def study_page(result: Result, figures: Figures, command: str) -> ReportPage:
    """Build the report of a study; `command` is for the provenance."""
    values, tables = result.values, result.study.tables_of(result)
    words = {word: said for table in tables for word, said in meanings(table.columns).items()}
    drawn = [picture(figure, caption) for figure, caption in figures.values()]
    sections = [Section("Results", tables=[_table(one) for one in tables])]
    if drawn:
        sections.append(Section("Figures", pictures=drawn))
    if values["notes"]:
        sections.append(Section("Notes", points=values["notes"]))
    if words:
        sections.append(Section("What the words mean", facts=words, explains=True))
    if len(values["arms"]) > 1:
        sections.append(Section("Arms", facts=values["arms"]))
    facts = {"Command": command, "Rows": str(values["rows"])}
    facts |= {
        name.capitalize(): str(values[name])
        for name in ("arm", "calibration", "limits", "seed")
        if name in values
    }
    sections.append(Section("Provenance", facts=facts))
    verdict = values.get("verdict") or [f"{counted(values['rows'], 'row')} were measured."]
    return ReportPage(values["title"], verdict, sections)


def _table(table: ResultTable) -> PageTable:
    more = len(table.entries) > LISTED and table.listing
    caption = f"{table.title}: the first {LISTED} of {len(table.entries)}" if more else table.title
    shown = table.entries[:LISTED] if more else table.entries
    return PageTable(titles(table.columns), cells(shown, table.columns), caption)
