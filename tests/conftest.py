"""What every test runs under: shapes and types checked, and no screen needed."""

import os
import signal

import pytest
from hypothesis import HealthCheck, settings

import browsing
import checking

checking.install()

if not (os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")):
    os.environ.setdefault("MUJOCO_GL", "egl")

# A shell lets what it starts in the background ignore Ctrl-C, and so would the commands under test.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)

# Neither a slow nor a busy machine is a fault, so no example has a deadline.
settings.register_profile("here", deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.register_profile("ci", settings.get_profile("here"), max_examples=50, derandomize=True)
settings.load_profile("ci" if os.environ.get("CI") else "here")


def pytest_runtest_setup():
    checking.begin_test()


@pytest.fixture(scope="session")
def chromium():
    """The system's Chromium; one for all tests."""
    sync_api = pytest.importorskip("playwright.sync_api")
    with sync_api.sync_playwright() as play:
        launched = browsing.launched(play)
        yield launched
        launched.close()


@pytest.fixture
def browser(chromium):
    """The browser, with no page open; a test's pages are closed after it."""
    yield chromium
    for context in chromium.contexts:
        context.close()
