"""What can be read off the paper's curves of reward (its Fig. 1) and off its text."""

GAITS = ("trot", "bound", "pace")
"""The paper's gaits, in the order in which it learns them (IV-B)."""

START = -25.0
"""Reward a control step at the first iteration, of all gaits; read off Fig. 1."""

PLATEAU = (25.0, 27.0)
"""Reward a control step that the curves end at; read off Fig. 1."""

ZERO_CROSSING = {"trot": 38, "bound": 52, "pace": 85}
"""Iteration at which each curve crosses zero; read off Fig. 1."""

LEARNED_BY = 100
"""Iteration by which a robot moves in the right way in most cases (IV-B)."""
