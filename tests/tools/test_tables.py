"""The pages with measured tables are what the results of their commands say."""

import json
from pathlib import Path

from tools.tables.pages import PAGES, page_of

ROOT = Path(__file__).parents[2]


def test_robustness_page_matches_its_result():
    result = json.loads((ROOT / "docs/results/robustness.json").read_text(encoding="utf-8"))
    assert result["command"] == PAGES["robustness"].command
    assert page_of("robustness", result) == (ROOT / PAGES["robustness"].path).read_text(encoding="utf-8")


def test_each_page_names_its_command():
    for page in PAGES.values():
        assert page.command in (ROOT / page.path).read_text(encoding="utf-8")
