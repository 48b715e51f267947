"""How fast the package is: the environment against bare physics, training against a baseline.

Only `trainer` and `baseline` need torch; they are imported when a training is measured.
"""
