"""Reward machines: a gait as a checked automaton over foot contacts (paper III-B, III-C)."""

from gaitshift.reward_machine.edge import Edge
from gaitshift.reward_machine.guard import Guard
from gaitshift.reward_machine.machine import RewardMachine, Step
from gaitshift.reward_machine.mermaid import mermaid
from gaitshift.reward_machine.picture import draw
from gaitshift.reward_machine.state import State
from gaitshift.reward_machine.toml_file import read_toml, tables_in

__all__ = [
    "Edge",
    "Guard",
    "RewardMachine",
    "State",
    "Step",
    "draw",
    "mermaid",
    "read_toml",
    "tables_in",
]
