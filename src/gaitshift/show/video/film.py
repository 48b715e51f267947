"""MP4 files from pictures, by the ffmpeg of imageio."""

from pathlib import Path
from typing import Any, cast

import imageio_ffmpeg
import numpy as np
from jaxtyping import UInt8

from gaitshift.errors import GaitshiftError
from gaitshift.show.video.canvas import VideoUnavailable

_QUALITY = 25
"""x264's constant rate factor."""

_RATE = 900
"""Largest bit rate [kbit/s]: 30 s stay below 4 MB."""


class FilmWriter:
    """Writes pictures of one size into an MP4 file, whole or not at all; a context manager."""

    def __init__(self, path: Path, width: int, height: int, fps: int) -> None:
        self._path, self._part = path, path.with_suffix(".part.mp4")
        try:
            self._frames = imageio_ffmpeg.write_frames(
                str(self._part),
                (width, height),
                fps=fps,
                codec="libx264",
                pix_fmt_out="yuv420p",
                macro_block_size=2,
                quality=cast(Any, None),
                output_params=[
                    *("-preset", "veryfast", "-crf", str(_QUALITY), "-movflags", "+faststart"),
                    *("-maxrate", f"{_RATE}k", "-bufsize", f"{2 * _RATE}k"),
                ],
            )
            self._frames.send(None)
        except RuntimeError as error:
            raise VideoUnavailable(
                f"videos need ffmpeg ({error}); install imageio[ffmpeg]"
            ) from error

    def add(self, picture: UInt8[np.ndarray, "height width 3"]) -> None:
        """Appends a picture: rows from the top, red, green, blue."""
        try:
            self._frames.send(np.ascontiguousarray(picture))
        except OSError as error:
            reason = str(error).splitlines()[0]
            raise GaitshiftError(f"{self._path} cannot be written: {reason}") from error

    def __enter__(self) -> "FilmWriter":
        return self

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        self._frames.close()
        if kind is None:
            self._part.replace(self._path)
        else:
            self._part.unlink(missing_ok=True)
