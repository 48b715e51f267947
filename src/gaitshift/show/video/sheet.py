"""A video at a glance: some of its pictures, side by side."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from jaxtyping import UInt8
from PIL import Image

from gaitshift.errors import GaitshiftError
from gaitshift.show.plots.palette import PAPER
from gaitshift.show.video.film import read_film

_COLUMNS, _WIDTH, _GAP = 3, 640, 8
"""Pictures in a row, width of one, and the space between them [pixel]."""


def contact_sheet(
    frames: Path | Sequence[UInt8[np.ndarray, "height width 3"]], out_png: Path, count: int = 12
) -> None:
    """Writes a PNG of `count` pictures, evenly spread over a video: a file, or its pictures.

    Raises:
        GaitshiftError: no such video, no pictures in it, or `count` less than 1.
    """
    if count < 1:
        raise GaitshiftError(f"count must be 1 or more, got {count}")
    chosen = _chosen(frames, count)
    width, height = chosen[0].width + _GAP, chosen[0].height + _GAP
    columns = min(_COLUMNS, count)
    rows = -(-count // columns)
    sheet = Image.new("RGB", (columns * width + _GAP, rows * height + _GAP), PAPER)
    for n, picture in enumerate(chosen):
        sheet.paste(picture, (_GAP + n % columns * width, _GAP + n // columns * height))
    sheet.save(out_png, optimize=True)


def _chosen(
    frames: Path | Sequence[UInt8[np.ndarray, "height width 3"]], count: int
) -> list[Image.Image]:
    """So many pictures, small. A file is read twice: its pictures do not fit into memory."""
    total = sum(1 for _ in read_film(frames)) if isinstance(frames, Path) else len(frames)
    if total == 0:
        raise GaitshiftError("frames must have at least one picture, got none")
    places = [round(i * (total - 1) / max(count - 1, 1)) for i in range(count)]
    pictures = read_film(frames) if isinstance(frames, Path) else frames
    small = {n: _shrunk(frame) for n, frame in enumerate(pictures) if n in places}
    return [small[place] for place in places]


def _shrunk(frame: UInt8[np.ndarray, "height width 3"]) -> Image.Image:
    image = Image.fromarray(frame)
    return image.resize((_WIDTH, round(_WIDTH * image.height / image.width)))
