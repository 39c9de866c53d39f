"""Reports: self-contained web pages with a verdict, tables, figures and provenance."""

from tvist_lab.report.of_advice import advice_page
from tvist_lab.report.of_recordings import recordings_page
from tvist_lab.report.of_studies import study_figures, study_page
from tvist_lab.report.page import PageTable, Picture, ReportPage, Section, render

__all__ = [
    "PageTable",
    "Picture",
    "ReportPage",
    "Section",
    "advice_page",
    "recordings_page",
    "render",
    "study_figures",
    "study_page",
]
