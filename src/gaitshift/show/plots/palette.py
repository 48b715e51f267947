"""The colours of every figure and video: one for each gait, one for each leg, and the neutrals."""

from collections.abc import Iterable
from zlib import crc32

INK, QUIET, PALE, PAPER = "#1f2933", "#616e7c", "#e4e7eb", "#ffffff"
"""Words and lines; words of less weight; grids; the ground they stand on."""

GROUND = "#b7a794"
"""The terrain, in profile."""

LEG_COLOURS = ("#3b2f8f", "#8a5a00", "#9a93d8", "#dda63a")
"""In the order of `LEGS`: left is violet, right is amber, front is dark, hind is light."""

_NAMED = {
    "trot": "#0072b2",
    "bound": "#d55e00",
    "pace": "#009e73",
    "pronk": "#cc79a7",
    "walk": "#56b4e9",
    "gallop": "#e69f00",
    "three_one": "#7b4ea3",
    "half_bound": "#8c6d46",
}
"""After Okabe and Ito (the first six; two of ours): told apart by every kind of colour vision."""

_OTHERS = ("#44aa99", "#882255", "#999933", "#332288", "#661100")
"""After Tol's muted scheme, for gaits that come from elsewhere."""


def gait_colours(names: Iterable[str]) -> dict[str, str]:
    """Colour of each gait: shipped gaits have their own, any other name always the same.

    Where two other names would share one, the later takes the next that is free, as long as there
    is one.
    """
    colours: dict[str, str] = {}
    for name in names:
        colours[name] = _NAMED.get(name) or _free(name, set(colours.values()))
    return colours


def _free(name: str, taken: set[str]) -> str:
    """The name's own colour among the others, or the first free one after it."""
    first = crc32(name.encode()) % len(_OTHERS)
    cycle = _OTHERS[first:] + _OTHERS[:first]
    return next((colour for colour in cycle if colour not in taken), cycle[0])
