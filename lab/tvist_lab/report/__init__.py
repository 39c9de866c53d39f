"""Reports: one self-contained web page each, with a verdict in a sentence, tables, figures and provenance."""

from tvist_lab.report.of_recordings import recordings_page, recordings_verdict
from tvist_lab.report.page import Page, PageTable, Picture, Section, render

__all__ = ["Page", "PageTable", "Picture", "Section", "recordings_page", "recordings_verdict", "render"]
