"""A machine drawn: as a picture, and as text that Mermaid draws."""

import subprocess
import sys

import pytest

from gaitshift.errors import GaitshiftError
from gaitshift.gait import RewardMachine, draw, mermaid
from trot_tables import FEET, SINK, TROT, edited


def test_mermaid_of_trot_tells_the_guard():
    guard = "FL_BR --> FR_BL : FR BL down, FL BR up, after 20 steps"
    assert guard in mermaid(RewardMachine.from_dict(TROT))


@pytest.mark.parametrize(("ending", "magic"), [(".png", b"\x89PNG"), (".svg", b"<?xml")])
def test_a_picture_is_drawn_and_the_same_each_time(tmp_path, ending, magic):
    tables = edited(state=[*TROT["state"], SINK])
    tables["transition"].append({"from": "FR_BL", "to": "sink", "down": list(FEET), "up": []})
    machine = RewardMachine.from_dict(tables)
    paths = [tmp_path / f"{n}{ending}" for n in range(2)]
    for path in paths:
        draw(machine, path)
    assert paths[0].read_bytes().startswith(magic)
    assert paths[0].read_bytes() == paths[1].read_bytes()


@pytest.mark.parametrize(
    ("name", "message"),
    [("trot.jpg", "must end in .png or .svg or .pdf"), ("no/trot.png", "no folder")],
)
def test_a_picture_that_cannot_be_written_is_refused(tmp_path, name, message):
    with pytest.raises(GaitshiftError, match=message):
        draw(RewardMachine.from_dict(TROT), tmp_path / name)


def test_the_machine_needs_no_drawing_library():
    code = "import sys, gaitshift.gait.gaits; sys.exit('matplotlib' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
