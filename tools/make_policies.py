"""Trains the shipped policies anew, each by the preset, seed and length that its record names.

Usage: python tools/make_policies.py [GAIT...]

The records are src/gaitshift/control/policies/GAIT.json. A training takes 5 to 15 minutes; one that
is over is not repeated. `tools/ship_policy.py` then puts the policies into the package. A gait such
as deployable/trot is the policy for real sensors.
"""

import json
import subprocess
import sys
from pathlib import Path

from gaitshift.control import policy
from gaitshift.errors import GaitshiftError

RUNS = Path("runs")
DEPLOYABLE = "deployable/"
"""Before the names of gaits whose policies are for real sensors."""


def commands(gait: str) -> tuple[Path, list[str]]:
    """The folder of the run, and the words of the command that trains the shipped policy."""
    record = json.loads(policy.record_file(gait).read_text(encoding="utf-8"))
    preset, seed = record["preset"], str(record["seed"])
    folder, gait = RUNS / f"{gait.replace('/', '-')}-{seed}", gait.removeprefix(DEPLOYABLE)
    if (folder / "config.json").is_file():
        return folder, ["train", "--resume", str(folder)]
    length = ["--iterations", str(record["iterations"])]
    asked = ["train", gait, "--preset", preset, "--seed", seed, *length, "--threads", "1"]
    return folder, [*asked, "--out", str(folder)]


def main(gaits: list[str]) -> None:
    """Trains one after the other, and ships all."""
    real = tuple(f"{DEPLOYABLE}{gait}" for gait in policy.shipped(DEPLOYABLE))
    known = (*policy.shipped(), *real)
    unknown = [gait for gait in gaits if gait not in known]
    if unknown:
        raise GaitshiftError(f"gaits must be some of {', '.join(known)}, got '{unknown[0]}'")
    ship = Path(__file__).with_name("ship_policy.py")
    for kind, options in ((policy.shipped(), []), (real, ["--deployable"])):
        folders: list[str] = []
        for gait in (gait for gait in gaits or known if gait in kind):
            folder, words = commands(gait)
            folders.append(str(folder))
            subprocess.run([sys.executable, "-m", "gaitshift", *words], check=True)
        if folders:
            subprocess.run([sys.executable, str(ship), *options, *folders], check=True)


if __name__ == "__main__":
    main(sys.argv[1:])
