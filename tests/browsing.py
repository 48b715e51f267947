"""Pages looked at in the system's Chromium."""

import shutil

import pytest

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser")

needed = pytest.mark.skipif(CHROMIUM is None, reason="no Chromium on this machine")

_FLAGS = ("--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader")


def opened(browser, address, **context):
    """A page on the address, and a list of what went wrong on it."""
    page = browser.new_context(viewport={"width": 1000, "height": 640}, **context).new_page()
    wrong = []
    page.on("console", lambda said: wrong.append(said.text) if said.type == "error" else None)
    page.on("pageerror", lambda error: wrong.append(str(error)))
    page.set_default_timeout(200_000)
    page.goto(address, wait_until="commit")
    return page, wrong


def launched(play):
    """Chromium without a screen, drawing in software."""
    return play.chromium.launch(executable_path=CHROMIUM, args=_FLAGS)
