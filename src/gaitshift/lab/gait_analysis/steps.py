"""Where feet come down: every onset of a contact, and those that end a swing."""

import numpy as np
from jaxtyping import Bool

AIR = 0.06
"""A foot that is up for less has bounced and not swung [s]. Ours: the shortest swing that a gait
here asks for is 0.08 s, bounces last 0.01 to 0.04 s."""

GROUND = 0.03
"""A foot that is down for less has stubbed and not stood [s]. Ours: the shortest stance that a gait
here asks for is 0.08 s."""


def onsets(contact: Bool[np.ndarray, "T N 4"]) -> Bool[np.ndarray, "T N 4"]:
    """Where a foot is down that was up in the step before; nowhere at the first step."""
    onset = np.zeros_like(contact)
    onset[1:] = contact[1:] & ~contact[:-1]
    return onset


def steady(contact: Bool[np.ndarray, "T N 4"], period: float) -> Bool[np.ndarray, "T N 4"]:
    """Contacts with bounces taken for stance, and then stubs for swing.

    Gaps shorter than `AIR` are closed first, contacts shorter than `GROUND` dropped after that.
    Stretches that reach the start or the end of the log stay, for their length is not known.
    `period` is the time of a step [s].
    """
    steps = contact.shape[0]
    rows = np.moveaxis(contact, 0, -1).reshape(contact.shape[1] * 4, steps)
    rows = _without_short(rows, value=False, least=AIR / period)
    rows = _without_short(rows, value=True, least=GROUND / period)
    return np.moveaxis(rows.reshape(*contact.shape[1:], steps), -1, 0)


def _without_short(
    rows: Bool[np.ndarray, "R T"], *, value: bool, least: float
) -> Bool[np.ndarray, "R T"]:
    """Rows whose inner stretches of `value` shorter than `least` steps are turned over."""
    count, steps = rows.shape
    if rows.size == 0:
        return rows
    flat = rows.ravel()
    begins = np.zeros(flat.size, dtype=bool)
    begins[1:] = flat[1:] != flat[:-1]
    begins[::steps] = True
    begin = np.flatnonzero(begins)
    length = np.diff(begin, append=flat.size)
    inner = (begin % steps > 0) & ((begin + length) % steps > 0)
    short = inner & (flat[begin] == value) & (length < least - 1e-9)
    return np.repeat(flat[begin] ^ short, length).reshape(count, steps)
