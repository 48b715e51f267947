"""The strip below the picture: gait, counter against threshold, speed, time."""

from dataclasses import dataclass
from pathlib import Path

import matplotlib
import numpy as np
from jaxtyping import UInt8
from PIL import Image, ImageDraw, ImageFont

from gaitshift.show.plots.style import INK, PAPER, QUIET

_SHARE = 0.125
"""Height of the strip, as a share of the whole picture."""

_UNIT = 90.0
"""Height of the strip for which the sizes below are defined [pixel]: a picture of 1280 × 720."""

_BAR_BACK = "#46535f"
_BAR = "#dfe5ea"


@dataclass(frozen=True, kw_only=True)
class Reading:
    """The content of the strip at one instant."""

    gait: str
    """Name of the present gait."""
    colour: str
    """The gait's."""
    k: float
    """Counter of the shift condition."""
    threshold: float
    """Threshold of k; 0 without a condition."""
    speed: float
    """Forward [m/s]."""
    time: float
    """[s]"""
    fallen: bool
    """Whether the robot has fallen."""


class Strip:
    """Draws readings, all in one size."""

    def __init__(self, width: int, picture_height: int) -> None:
        self.width = width
        self.height = 2 * round(_SHARE * picture_height / 2)
        """[pixel], even, as the video codec requires."""
        self._scale = self.height / _UNIT
        self._large = _font("DejaVuSans-Bold.ttf", 34 * self._scale)
        self._plain = _font("DejaVuSans.ttf", 30 * self._scale)
        self._small = _font("DejaVuSans.ttf", 25 * self._scale)

    def draw(self, reading: Reading) -> UInt8[np.ndarray, "height width 3"]:
        """The strip as pixels, red, green, blue."""
        image = Image.new("RGB", (self.width, self.height), INK)
        pen = ImageDraw.Draw(image)
        self._draw_gait(pen, reading)
        if reading.threshold > 0:
            self._draw_counter(pen, reading)
        right, middle = self.width - self._px(32), self.height / 2
        pen.text((right, middle), f"{reading.time:.1f} s", PAPER, self._plain, "rm")
        speed = f"{round(reading.speed, 2) + 0.0:.2f} m/s"  # never -0.00
        pen.text((right - self._px(140), middle), speed, PAPER, self._plain, "rm")
        return np.asarray(image)

    def _draw_gait(self, pen: ImageDraw.ImageDraw, reading: Reading) -> None:
        word = "fallen" if reading.fallen else reading.gait
        end = self._px(32) + max(self._px(200), pen.textlength(word, self._large) + self._px(48))
        box = (self._px(32), self._px(15), end, self.height - self._px(15))
        pen.rounded_rectangle(box, self._px(14), QUIET if reading.fallen else reading.colour)
        middle = ((box[0] + box[2]) / 2, self.height / 2)
        pen.text(middle, word, PAPER, self._large, "mm")

    def _draw_counter(self, pen: ImageDraw.ImageDraw, reading: Reading) -> None:
        left, right = self._px(330), self.width - self._px(390)
        pen.text((left, self._px(33)), f"k = {reading.k:.0f}", PAPER, self._small, "lm")
        limit = f"shift above β = {reading.threshold:g}"
        pen.text((right, self._px(33)), limit, _BAR, self._small, "rm")
        share = float(np.clip(reading.k / reading.threshold, 0.0, 1.0))
        top, bottom = self._px(54), self._px(70)
        pen.rectangle((left, top, right, bottom), _BAR_BACK)
        if share > 0:
            pen.rectangle((left, top, left + share * (right - left), bottom), _BAR)

    def _px(self, measure: float) -> float:
        return measure * self._scale


def _font(name: str, size: float) -> ImageFont.FreeTypeFont:
    """The typeface of the figures, which comes with matplotlib."""
    return ImageFont.truetype(Path(matplotlib.get_data_path()) / "fonts" / "ttf" / name, size)
