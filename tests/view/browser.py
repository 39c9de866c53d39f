"""A headless browser, and pages of `tvist view` in processes of their own."""

import os
import re
import sys
from contextlib import contextmanager

import pytest
from tests import forked
from tests.conformance.served import Served
from tools.film import FLAGS
from tools.film import browser as browser_that_draws

CHROMIUM = browser_that_draws()
ARGUMENTS = [flag for flag in FLAGS if not flag.startswith("--headless")]  # playwright says that itself


@contextmanager
def browser():
    """Start Chromium; if there is none, skip the test, but fail in CI."""
    if CHROMIUM is None:
        if os.environ.get("CI"):
            raise AssertionError("there is no Chromium: .ci/run installs it")
        pytest.skip("there is no Chromium: apt-get install chromium")
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        started = playwright.chromium.launch(executable_path=CHROMIUM, args=ARGUMENTS)
        try:
            yield started
        finally:
            started.close()


class Page(Served):
    """A process that serves a page by `tvist view`; `url` is where its page is."""

    program = ("-m", "tvist_cli", "view")

    def __init__(self, *arguments):
        words = [sys.executable, *self.program, *map(str, arguments), "--port", "0"]
        self._begin(forked.Popen, words, {**os.environ, "PYTHONUNBUFFERED": "1", "COLUMNS": "200"})

    def wait_until_ready(self):
        self.wait_until_said("http://")

    def __exit__(self, *error):
        self.kill()

    @property
    def url(self):
        return re.search(r"http://\S+", self.said).group()
