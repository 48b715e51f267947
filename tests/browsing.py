"""Pages looked at in the system's Chromium."""

import shutil
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from waiting import PATIENCE, wait_until

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser")

SCREENS = Path(__file__).parent.parent / "out" / "screens"

needed = pytest.mark.skipif(CHROMIUM is None, reason="no Chromium on this machine")

_OPAQUE = """
    document.addEventListener("DOMContentLoaded", () => {
        const style = document.createElement("style");
        style.textContent = "canvas { opacity: 1 !important }";
        document.head.append(style);
    });
"""
"""Shows the three-dimensional picture at once: viser fades it in, a little with each picture that
it draws, which takes minutes on a busy machine without a graphics card."""

_DRAWS_NOTHING = """
    for (const of of ["Elements", "Arrays", "ElementsInstanced", "ArraysInstanced"])
        WebGL2RenderingContext.prototype["draw" + of] = () => {};
    const next = window.requestAnimationFrame.bind(window);
    window.requestAnimationFrame = (frame) => setTimeout(() => next(frame), 250);
"""
"""Leaves a page's three-dimensional picture empty, and renews it seldom."""

_FLAGS = ("--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader")


def opened(browser, address, *, draws=True, **context):
    """A page on the address, and a list of what went wrong on it.

    To draw in three dimensions by software takes most of a page's time, a second a picture: a page
    whose picture nobody looks at need not.
    """
    page = browser.new_context(viewport={"width": 1000, "height": 640}, **context).new_page()
    page.add_init_script(_OPAQUE)
    if not draws:
        page.add_init_script(_DRAWS_NOTHING)
    wrong = []
    page.on("console", lambda said: wrong.append(said.text) if said.type == "error" else None)
    page.on("pageerror", lambda error: wrong.append(str(error)))
    page.set_default_timeout(1000 * PATIENCE)
    page.goto(address, wait_until="commit")
    return page, wrong


def click(locator):
    """Clicks on it as soon as it can be clicked.

    Playwright waits for two frames in which it stands still. Beside busy neighbours Chromium
    sometimes loses the one that is asked for, and the wait never ends: then it asks again.
    """
    from playwright.sync_api import TimeoutError as TooLate  # may not be installed

    def clicked():
        try:
            locator.click(timeout=1000 * PATIENCE / 10)
        except TooLate:
            return False
        return True

    wait_until(clicked)


def keep(page, name):
    """A screenshot for whoever looks at what a test run leaves: out/screens/NAME.png.

    Its points as an array of rows, columns and colours.
    """
    SCREENS.mkdir(parents=True, exist_ok=True)
    path = SCREENS / f"{name}.png"
    page.screenshot(path=path)
    return np.asarray(Image.open(path).convert("RGB"))


def shows_a_robot(points):
    """Whether something dark, as the robot is, stands in the middle of a bright picture."""
    high, wide, _ = points.shape
    middle = points[high // 6 : -high // 6, wide // 6 : -wide // 6].max(axis=2)
    return 0.003 < np.mean(middle < 80) < 0.4 and np.mean(middle > 120) > 0.3


def wait_for_robot(page, name, columns=1.0, rows=1.0):
    """Until the page shows a robot in this share of its columns and rows, from the top left.

    The last screenshot is kept as out/screens/NAME.png.
    """

    def shown():
        points = keep(page, name)
        high, wide, _ = points.shape
        return shows_a_robot(points[: round(high * rows), : round(wide * columns)])

    wait_until(shown, pause=2.0)


def launched(play):
    """Chromium without a screen, drawing in software."""
    return play.chromium.launch(executable_path=CHROMIUM, args=_FLAGS)
