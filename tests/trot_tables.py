"""A trot as tables of a gait file, changed copies of it, and contacts by names of feet."""

from copy import deepcopy

import numpy as np
from hypothesis import settings

FEET = ("FL", "FR", "BL", "BR")
TROT = {
    "name": "trot",
    "title": "Trot",
    "description": "Diagonal feet together.",
    "dwell": 20,
    "swing_height": 0.03,
    "ideal_phase": {"FL": 0.0, "FR": 0.5, "BL": 0.5, "BR": 0.0},
    "state": [
        {"name": "FL_BR", "stance": ["FL", "BR"]},
        {"name": "FR_BL", "stance": ["FR", "BL"]},
    ],
    "transition": [
        {"from": "FL_BR", "to": "FR_BL", "down": ["FR", "BL"], "up": ["FL", "BR"]},
        {"from": "FR_BL", "to": "FL_BR", "down": ["FL", "BR"], "up": ["FR", "BL"]},
    ],
}
SINK = {"name": "sink", "accepting": True}

quick = settings(max_examples=60, deadline=None)
"""Few examples, without a limit on the time of each."""


def contacts(*patterns):
    """Rows such as "FL BR" as contact booleans (N, 4)."""
    return np.array([[foot in pattern.split() for foot in FEET] for pattern in patterns])


def ints(*values):
    return np.array(values)


def edited(**changes):
    """Trot with keys set, as in `transition__1__up=[]`, and removed where the value is None."""
    tables = deepcopy(TROT)
    for where, value in changes.items():
        *path, last = (int(part) - 1 if part.isdigit() else part for part in where.split("__"))
        place = tables
        for part in path:
            place = place[part]
        place[last] = value
        if value is None:
            del place[last]
    return tables
