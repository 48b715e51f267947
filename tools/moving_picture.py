"""A film as a small moving picture for the README.

Usage: python tools/moving_picture.py out/demo/demo.mp4 docs/results/demo.webp
"""

import subprocess
import sys
from pathlib import Path

import imageio_ffmpeg

FROM, UNTIL = 4.0, 21.0
"""The part that is shown [s]: some steps before the first shift to some after the second."""

FASTER, RATE, WIDTH = 1.5, 12, 640
"""Times real time, pictures a second, width [pixels]."""


def shrink(film: Path, picture: Path) -> None:
    """Writes the part of `film` as an animated WebP."""
    steps = f"trim={FROM}:{UNTIL},setpts=(PTS-STARTPTS)/{FASTER},fps={RATE},scale={WIDTH}:-2"
    look = ["-c:v", "libwebp", "-quality", "55", "-compression_level", "6", "-loop", "0"]
    command = [imageio_ffmpeg.get_ffmpeg_exe(), "-y", "-loglevel", "error", "-i", str(film)]
    subprocess.run([*command, "-vf", steps, *look, str(picture)], check=True)


if __name__ == "__main__":
    shrink(Path(sys.argv[1]), Path(sys.argv[2]))
