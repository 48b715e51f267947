"""Reward machines: a gait as a checked automaton over foot contacts (paper III-B, III-C)."""

from gaitshift.gait.edge import Edge
from gaitshift.gait.guard import Guard
from gaitshift.gait.machine import RewardMachine, Step
from gaitshift.gait.mermaid import mermaid
from gaitshift.gait.picture import draw
from gaitshift.gait.state import State
from gaitshift.gait.toml_file import read_toml

__all__ = [
    "Edge",
    "Guard",
    "RewardMachine",
    "State",
    "Step",
    "draw",
    "mermaid",
    "read_toml",
]
