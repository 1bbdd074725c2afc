"""Chromium, for tests that open a page."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest


@contextmanager
def chromium() -> Iterator[Any]:
    """The browser of the system if there is one, else that of Playwright."""
    playwright = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
    with playwright.sync_playwright() as driver:
        path = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
        if path is None and not Path(driver.chromium.executable_path).exists():
            pytest.skip("no browser found; install Chromium, or run `playwright install chromium`")
        started = driver.chromium.launch(executable_path=path, args=["--no-sandbox"])
        yield started
        started.close()


def opened(browser: Any, address: str, width: int = 1400) -> tuple[Any, list[str]]:
    """A page, and what it complains of or loads besides itself, but for a software renderer's stalls."""
    page = browser.new_page(viewport={"width": width, "height": 900})
    page.set_default_timeout(120_000)
    troubles: list[str] = []

    def note(text: str) -> None:
        if "GPU stall" not in text and not text.startswith(("data:", "blob:", address)):
            troubles.append(text)

    page.on("console", lambda message: note(message.text))
    page.on("pageerror", lambda error: note(f"error: {error}"))
    page.on("request", lambda request: note(request.url))
    page.goto(address)
    return page, troubles
