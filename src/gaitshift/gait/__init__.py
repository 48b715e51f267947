"""Reward machines: a gait as a checked automaton over foot contacts (paper III-B, III-C)."""

from gaitshift.gait.drawing import draw, mermaid
from gaitshift.gait.elements import Guard, State, Transition
from gaitshift.gait.machine import RewardMachine, Step, read_toml

__all__ = [
    "Guard",
    "RewardMachine",
    "State",
    "Step",
    "Transition",
    "draw",
    "mermaid",
    "read_toml",
]
