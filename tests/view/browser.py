"""A headless browser, and pages of `tvist view` in processes of their own."""

import os
import re
import subprocess
import sys
import threading
from contextlib import contextmanager

import pytest
from tests import forked
from tests.conformance.served import PATIENCE
from tools.film import FLAGS
from tools.film import browser as browser_that_draws

CHROMIUM = browser_that_draws()
ARGUMENTS = [flag for flag in FLAGS if not flag.startswith("--headless")]  # playwright says that itself


@contextmanager
def browser():
    """Chromium; without one the test is skipped, but not in CI."""
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


class Page:
    """A process that serves a page, `tvist view` by default; `url` is where its page is."""

    def __init__(self, *arguments, command="view"):
        self.lines = []
        self._news = threading.Condition()
        self.process = forked.Popen(
            [sys.executable, "-m", "tvist_cli", command, *map(str, arguments), "--port", "0"],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            env={**os.environ, "PYTHONUNBUFFERED": "1", "COLUMNS": "200"},
        )
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    def __enter__(self):
        self.said(r"http://")
        return self

    def __exit__(self, *error):
        if self.process.poll() is None:
            self.process.kill()
        self.process.wait(PATIENCE)
        self._reader.join(PATIENCE)
        self.process.stdout.close()
        self.process.stderr.close()

    @property
    def url(self):
        return re.search(r"http://\S+", "".join(self.lines)).group()

    def said(self, words):
        """Wait until it says something on stderr."""
        with self._news:
            assert self._news.wait_for(lambda: re.search(words, "".join(self.lines)), PATIENCE), self.lines
        return "".join(self.lines)

    def _read(self):
        for line in self.process.stderr:
            with self._news:
                self.lines.append(line)
                self._news.notify_all()
