"""The gaits that come with the package: one TOML file each, beside this one.

Gaits are data: a new file here is a new gait, and `load` takes any other file by its path. A file
is checked when it is read, and no code in it runs. It holds

- `name`, `title`, `description`: short name, name for people, what the gait is;
- `dwell` [control steps] and `swing_height` [m, 0 if left out]: defaults of the transitions; a
  swing below its height earns only a part of the bonus;
- `dwell_range` [control steps]: least and greatest dwell that may be commanded, through the stride
  frequency; transitions with their own dwell keep their proportion. `dwell` alone if left out;
- `speed` [m/s, the paper's 1.2 if left out] and `speed_range` [m/s, `speed` alone if left out]:
  the nominal speed, and the range of the command;
- `lateral_speed` [m/s, 0 if left out]: the greatest command to either side;
- `height` [m, from that of the robot's stance, 0 if left out] and `height_range` [m]: the nominal
  body height, and the range of the command; without a range the height is not commanded;
- `ideal_phase`: touchdown of each foot [fraction of the stride, 0 to below 1];
- `[[state]]`, the first one initial: `name`, and `stance`, the feet down; or `name` and
  `accepting = true` for a state in which the run ends;
- `[[transition]]`: `from`, `to`, `down` (feet that must touch), `up` (feet that must not; the
  others are free), and if wanted `dwell`, `swing_height` and `bonus` (factor on the shared bonus).
  A gait of one state without transitions stands; its `speed` may be 0.
"""

from pathlib import Path

from gaitshift.data import known_names
from gaitshift.errors import GaitshiftError
from gaitshift.gait import RewardMachine, read_toml

_FOLDER = Path(__file__).parent


def names() -> tuple[str, ...]:
    """Names of the shipped gaits, in alphabetical order."""
    return tuple(sorted(file.stem for file in _FOLDER.glob("*.toml")))


def load(name_or_path: str | Path) -> RewardMachine:
    """Load the machine of a shipped gait by its name, or of a gait file by its path.

    A `Path`, and a string that ends in .toml, is a path. Raises `GaitshiftError` where there is no
    such gait, naming those there are, or where the file is faulty.
    """
    if isinstance(name_or_path, Path) or name_or_path.endswith(".toml"):
        return read_toml(Path(name_or_path))
    if name_or_path not in names():
        hint = "or give the path of a .toml file"
        raise GaitshiftError(f"{known_names('gait', name_or_path, names())}; {hint}")
    return read_toml(_FOLDER / f"{name_or_path}.toml")
