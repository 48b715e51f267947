"""The style of all figures: colours, typeface, axes."""

# matplotlib's own stubs leave **kwargs untyped:
# pyright: reportUnknownMemberType=false, reportUnknownVariableType=false

from collections.abc import Generator, Iterable
from contextlib import contextmanager
from io import BytesIO
from pathlib import Path
from typing import Any, cast
from zlib import crc32

from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from PIL import Image

from gaitshift.errors import GaitshiftError
from gaitshift.whole_file import replacing

INK, QUIET, PALE, PAPER = "#1f2933", "#616e7c", "#e4e7eb", "#ffffff"
"""Colours of text and lines, of secondary text, of grids, and of the background."""

GROUND = "#b7a794"
"""Colour of the terrain in profile."""

LEG_COLOURS = ("#3b2f8f", "#8a5a00", "#9a93d8", "#dda63a")
"""Colours in the order of `LEGS`: left is violet, right is amber, front is dark, hind is light."""

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
"""After Okabe and Ito (the first six, and two more): distinct for every kind of colour vision."""

_OTHERS = ("#44aa99", "#882255", "#999933", "#332288", "#661100")
"""After Tol's muted scheme, for gaits that are not shipped."""


def gait_colours(names: Iterable[str]) -> dict[str, str]:
    """Colour of each gait: shipped gaits have their own, any other name always the same.

    Where two other names share a colour, the later one takes the next free colour, if any.
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


FORMATS = (".png", ".svg", ".pdf")
"""File endings that figures are written to."""

DPI = 160
"""Pixels an inch: a figure 10 inches wide has 1600 pixels."""

DASHES = (0, (4, 2))
"""Line style of commanded values, beside measured ones."""

_STYLE: dict[str, Any] = {
    "font.family": "DejaVu Sans",  # comes with matplotlib: the same words on every machine
    "font.size": 13,
    "text.color": INK,
    "text.parse_math": False,  # names may hold "$"
    "figure.facecolor": PAPER,
    "axes.facecolor": PAPER,
    "axes.edgecolor": QUIET,
    "axes.labelcolor": INK,
    "axes.labelsize": 13,
    "axes.linewidth": 0.8,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.spines.left": False,
    "axes.grid": True,
    "axes.grid.axis": "y",
    "axes.axisbelow": True,
    "grid.color": PALE,
    "grid.linewidth": 0.8,
    "xtick.color": QUIET,
    "ytick.color": QUIET,
    "xtick.labelsize": 12,
    "ytick.labelsize": 12,
    "ytick.major.size": 0,
    "lines.linewidth": 1.8,
    "lines.solid_capstyle": "round",
    "path.simplify_threshold": 0.5,
    "legend.frameon": False,
    "svg.hashsalt": "gaitshift",
}


@contextmanager
def house_style() -> Generator[None]:
    """A context with this style, independent of the user's own settings."""
    with rc_context(cast(Any, _STYLE)):
        yield


def check_target(path: Path) -> None:
    """`GaitshiftError` unless a figure can be written to `path`; called before any work."""
    if path.suffix.lower() not in FORMATS:
        raise GaitshiftError(f"{path}: the name of a figure must end in {' or '.join(FORMATS)}")
    if not path.parent.is_dir():
        raise GaitshiftError(f"{path}: no folder {path.parent}")


def save(figure: Figure, path: Path) -> None:
    """Writes the figure, the same bytes for the same figure; a PNG in 256 colours, to be small."""
    ending = path.suffix.lower()
    if ending != ".png":
        undated = {"Date": None} if ending == ".svg" else {"CreationDate": None}
        with replacing(path) as part:
            figure.savefig(part, format=ending[1:], metadata=undated)
        return
    pixels = BytesIO()
    figure.savefig(pixels, format="png", dpi=DPI)
    with Image.open(pixels) as image:
        few = image.convert("RGB").quantize(256, Image.Quantize.MEDIANCUT, dither=Image.Dither.NONE)
        with replacing(path) as part:
            few.save(part, format="PNG", optimize=True)


def name_row(axes: Axes, label: str) -> None:
    """Labels the y axis horizontally at its upper end, so that it is legible on a small screen."""
    axes.set_ylabel(label, rotation=0, ha="left", va="bottom")
    axes.yaxis.set_label_coords(0.0, 1.04)


def few_ticks(axes: Axes) -> None:
    """Few ticks on the y axis, at round numbers."""
    axes.yaxis.set_major_locator(MaxNLocator(4, steps=[1, 2, 5, 10]))
