"""What every test runs under: shapes and types checked, and no screen needed."""

import os
import signal

import pytest
from beartype import BeartypeConf, beartype
from hypothesis import HealthCheck, settings
from jaxtyping import install_import_hook

import browsing

check_types = beartype(conf=BeartypeConf(is_pep484_tower=True))
"""beartype that takes an int for a float, as type checkers do (PEP 484)."""

# Before anything of gaitshift is imported: its annotations then hold whenever a test runs.
install_import_hook("gaitshift", "conftest.check_types")

if not (os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")):
    os.environ.setdefault("MUJOCO_GL", "egl")

# A shell lets what it starts in the background ignore Ctrl-C, and so would the commands under test.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)

# Neither a slow nor a busy machine is a fault, so no example has a deadline.
settings.register_profile("here", deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.register_profile("ci", settings.get_profile("here"), max_examples=50, derandomize=True)
settings.load_profile("ci" if os.environ.get("CI") else "here")


@pytest.fixture
def browser():
    """The system's Chromium."""
    sync_api = pytest.importorskip("playwright.sync_api")
    with sync_api.sync_playwright() as play:
        chromium = browsing.launched(play)
        yield chromium
        chromium.close()
