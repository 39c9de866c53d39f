"""Reports: one self-contained web page each, with a verdict in a sentence, tables, figures and provenance."""

from tvist_lab.report.of_advice import advice_page
from tvist_lab.report.of_recordings import recordings_page
from tvist_lab.report.of_studies import evaluation_page, shaperbench_page, study_page
from tvist_lab.report.page import Page, PageTable, Picture, Section, render

__all__ = [
    "Page",
    "PageTable",
    "Picture",
    "Section",
    "advice_page",
    "evaluation_page",
    "recordings_page",
    "render",
    "shaperbench_page",
    "study_page",
]
