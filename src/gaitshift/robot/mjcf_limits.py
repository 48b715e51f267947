"""Limits of an MJCF file, checked on its text: MuJoCo allocates before it complains."""

import xml.etree.ElementTree as ET
from collections.abc import Iterator
from pathlib import Path

from gaitshift.data import bytes_in, located
from gaitshift.errors import GaitshiftError

MOST_BYTES = 16 << 20
"""Size of the largest MJCF file [bytes]; ours: room for meshes written out as numbers."""

MOST_ASSET_BYTES = 256 << 20
"""Size of the largest mesh, texture or height field file [bytes]; ours: models have 30 MB."""

MOST_FILES = 50
"""Most MJCF files that include each other; ours."""

MOST_DEPTH = 100
"""Greatest depth of elements; ours: a leg has three bodies in each other."""

MOST_ELEMENTS = 20_000
"""Most elements, copies by `replicate` among them; ours: a hundred times a robot's."""

MOST_SAMPLES = 4_000_000
"""Most samples of a height field or pixels of a texture that is made; ours: 2000 × 2000."""

MOST_SIZE = 10_000
"""Greatest value of other attributes that say how much is allocated; ours."""

MOST_MEMORY = 1 << 30
"""Greatest memory for contacts that a model may ask for [bytes]; ours."""

LEAST_TIMESTEP = 0.0001
"""Least physics step [s]; ours: a hundred of them a control step."""

_SIZES = frozenset(
    (
        *("actdim", "count", "data", "dim", "interp", "nconmax", "nemax", "njmax", "nkey"),
        *("nsample", "nstack", "nuserdata", "resolution", "size", "vertcount"),
        *(f"nuser_{of}" for of in ("actuator", "body", "cam", "geom", "jnt", "sensor", "site")),
        "nuser_tendon",
    )
)
"""Attributes that say how much is allocated, of elements in `_SIZED`; `count` may be several."""

_SIZED = frozenset(
    ("camera", "composite", "flexcomp", "general", "numeric", "replicate", "sensor", "size", "user")
)
_INCLUDES = frozenset(("include", "model"))
_ASSETS = frozenset(("hfield", "mesh", "skin", "texture"))
_UNITS = {"K": 1 << 10, "M": 1 << 20, "G": 1 << 30, "T": 1 << 40, "P": 1 << 50, "E": 1 << 60}


def check_mjcf(path: Path) -> None:
    """`GaitshiftError`, one line, where a model or a file that it includes is beyond the limits.

    Files that do not exist are left to MuJoCo.
    """
    files, seen, elements = [path], set[Path](), 0
    while files:
        file = files.pop()
        if file in seen or not file.is_file():
            continue
        seen.add(file)
        if len(seen) > MOST_FILES:
            raise GaitshiftError(f"files that include each other must be {MOST_FILES} or fewer")
        try:
            root = ET.fromstring(bytes_in(file, MOST_BYTES))
        except ET.ParseError as error:
            what = "the model" if file == path else file.name
            raise GaitshiftError(f"{what} must be XML: {error}") from None
        with located("the model" if file == path else file.name):
            elements += _count(root)
            if elements > MOST_ELEMENTS:
                raise GaitshiftError(f"elements must be {MOST_ELEMENTS} or fewer, got {elements}")
            for element in root.iter():
                _check_element(element)
            _check_assets(root, path.parent)
        files += [path.parent / name for name in _files_of(root, _INCLUDES)]


def _count(root: ET.Element) -> int:
    """Elements of a file once `replicate` has copied what is inside."""
    total, waiting = 0, [(root, 1, 0)]
    while waiting:
        element, copies, depth = waiting.pop()
        if depth > MOST_DEPTH:
            raise GaitshiftError(f"elements must be at most {MOST_DEPTH} inside each other")
        total += copies
        if element.tag in ("replicate", "composite", "flexcomp"):
            copies *= _product(element.get("count", "1"))
            total += copies
        waiting += [(inner, copies, depth + 1) for inner in element]
    return total


def _check_element(element: ET.Element) -> None:
    tag = str(element.tag)
    if tag in ("hfield", "texture"):
        for pair in (("nrow", "ncol"), ("width", "height")):
            samples = _product(" ".join(element.get(name, "1") for name in pair))
            if samples > MOST_SAMPLES:
                raise GaitshiftError(
                    f"{tag}: {' × '.join(pair)} must be {MOST_SAMPLES} or less, got {samples}"
                )
    if tag in _SIZED:
        for name in _SIZES.intersection(element.keys()):
            if _product(element.get(name, "")) > MOST_SIZE:
                raise GaitshiftError(
                    f"{tag}: {name} must be {MOST_SIZE} or less, got {element.get(name, '')[:20]}"
                )
    if tag == "size":
        _check_memory(element.get("memory", "0"))
    if tag == "option":
        _check_timestep(element.get("timestep", "0.002"))


def _check_memory(text: str) -> None:
    number, unit = text.strip(), 1
    if number[-1:].upper() in _UNITS:
        number, unit = number[:-1], _UNITS[number[-1:].upper()]
    if _product(number) * unit > MOST_MEMORY:
        raise GaitshiftError(f"size: memory must be {MOST_MEMORY >> 20}M or less, got {text[:20]}")


def _check_timestep(text: str) -> None:
    try:
        timestep = float(text)
    except ValueError:
        return  # MuJoCo says what is wrong with it
    if not LEAST_TIMESTEP <= timestep < 1.0:
        raise GaitshiftError(
            f"timestep must be {LEAST_TIMESTEP:g} s or more and below 1 s, got {timestep:g}"
        )


def _check_assets(root: ET.Element, folder: Path) -> None:
    """Sizes of the files of meshes, textures and height fields, where the compiler finds them."""
    places = {folder}
    for compiler in root.iter("compiler"):
        places |= {folder / compiler.get(n, "") for n in ("meshdir", "texturedir", "assetdir")}
    for name in _files_of(root, _ASSETS):
        for place in places:
            file = place / name
            if file.is_file() and file.stat().st_size > MOST_ASSET_BYTES:
                raise GaitshiftError(
                    f"{name} must have {MOST_ASSET_BYTES >> 20} MB or less, got "
                    f"{file.stat().st_size >> 20} MB"
                )


def _files_of(root: ET.Element, tags: frozenset[str]) -> Iterator[str]:
    """The files that elements with these tags name."""
    for element in root.iter():
        if element.tag in tags and (name := element.get("file")):
            yield name


def _product(text: str) -> int:
    """Product of the whole numbers in an attribute, those below 1 left out; 1 without any."""
    product = 1
    for part in text.split():
        if part.lstrip("+").isdecimal() and len(part) < 20:
            product *= max(int(part), 1)
        elif part.lstrip("+").isdecimal():
            return MOST_MEMORY * MOST_MEMORY
    return product
