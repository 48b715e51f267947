"""OpenGL by `MUJOCO_GL`, loaded when the first picture is drawn.

MuJoCo loads it when it is imported, and cannot be imported where that fails. Only films need it.
"""

import os
import sys
from collections.abc import Generator
from contextlib import contextmanager
from importlib import import_module
from typing import Any

CHOICE = "GAITSHIFT_GL"
"""Environment variable with the user's `MUJOCO_GL` while MuJoCo sees another value."""

_BACKENDS = ("egl", "glfw", "osmesa") if sys.platform == "linux" else ("glfw", "cgl")
_DEFAULT = ("", "enable", "enabled", "on", "true", "1")
_OFF = ("disable", "disabled", "off", "false", "0")
"""What MuJoCo understands beside the names of backends."""


@contextmanager
def postponed() -> Generator[None]:
    """Lets MuJoCo be imported without OpenGL, whatever `MUJOCO_GL` says."""
    before = {name: os.environ.get(name) for name in (CHOICE, "MUJOCO_GL")}
    os.environ.setdefault(CHOICE, os.environ.get("MUJOCO_GL", ""))
    os.environ["MUJOCO_GL"] = "disable"
    try:
        yield
    finally:
        for name, value in before.items():
            os.environ.pop(name)
            if value is not None:
                os.environ[name] = value


def open_context(width: int, height: int) -> Any:
    """An OpenGL context of this size, made current, by the backend that `MUJOCO_GL` names.

    By default Linux without a display uses EGL, which needs no screen. Each backend fails in its
    own class of error where it is missing.
    """
    choice = os.environ.get(CHOICE, os.environ.get("MUJOCO_GL", "")).strip().lower()
    if choice in _OFF:
        raise RuntimeError(f"MUJOCO_GL={choice} turns it off")
    if choice not in (*_DEFAULT, *_BACKENDS):
        known = ", ".join((*_BACKENDS, _OFF[0]))
        raise RuntimeError(f"MUJOCO_GL must be one of {known}, got '{choice}'")
    backend = _default() if choice in _DEFAULT else choice
    context = import_module(f"mujoco.{backend}").GLContext(width, height)
    context.make_current()
    return context


def _default() -> str:
    if sys.platform == "linux":
        display = os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")
        return "glfw" if display else "egl"
    return "cgl" if sys.platform == "darwin" else "glfw"
