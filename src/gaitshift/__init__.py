"""Quadruped gaits as reward machines, and the conditions by which a robot shifts them itself."""

__version__ = "0.2.0"
