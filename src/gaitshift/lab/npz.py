"""Reads npz files within a limit of memory, checked before anything is allocated."""

import math
import zipfile
from collections.abc import Collection
from pathlib import Path
from typing import Any, cast

import numpy as np

from gaitshift.errors import GaitshiftError

MOST_BYTES = 4 << 30
"""Most memory for the arrays of a file; ours: a log of 1000 robots over 90 s."""


def arrays_in(path: Path, names: Collection[str]) -> dict[str, np.ndarray]:
    """The arrays of these names that a file has.

    Raises:
        GaitshiftError: no such file, not a complete npz file, or larger than `MOST_BYTES`.
    """
    if not path.is_file():
        raise GaitshiftError(f"no log file {path}")
    arrays, total = dict[str, np.ndarray](), 0
    try:
        with zipfile.ZipFile(path) as archive:
            there = {info.filename: info for info in archive.infolist()}
            for name in names:
                info = there.get(f"{name}.npy")
                if info is None:
                    continue
                total += _size(name, archive, info)
                if total > MOST_BYTES:
                    raise GaitshiftError(
                        f"{path}: arrays must have {MOST_BYTES >> 30} GB or less in all, got "
                        f"{total / (1 << 30):.3g} GB up to '{name}'"
                    )
                with archive.open(info) as member:
                    arrays[name] = np.lib.format.read_array(member, allow_pickle=False)
    except GaitshiftError:
        raise
    except Exception as error:  # zipfile, zlib, tokenize and numpy have no common class
        why = (str(error).splitlines() or [type(error).__name__])[0]
        raise GaitshiftError(f"{path} is not a complete npz file: {why}") from error
    return arrays


def _size(name: str, archive: zipfile.ZipFile, info: zipfile.ZipInfo) -> int:
    """Size of an array by its header [bytes]; `ValueError` where its data are of another size."""
    formats = cast(Any, np.lib.format)
    with archive.open(info) as member:
        version = formats.read_magic(member)
        if version not in ((1, 0), (2, 0)):
            raise ValueError(f"'{name}' is an array of format {version}, must be 1.0 or 2.0")
        read = formats.read_array_header_1_0 if version[0] == 1 else formats.read_array_header_2_0
        shape, _, dtype = read(member)
        size = math.prod(shape) * dtype.itemsize
        if dtype.hasobject or size != info.file_size - member.tell():
            raise ValueError(
                f"'{name}' must have the {size} bytes of its shape, got "
                f"{info.file_size - member.tell()}"
            )
    return size
