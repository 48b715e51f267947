"""A body turned by roll, pitch and yaw, written from the geometry."""

import numpy as np


def rotation(roll, pitch, yaw):
    """Body axes in the world as columns: yaw, then pitch, then roll, each about the body's axis."""
    (cr, cp, cy), (sr, sp, sy) = np.cos([roll, pitch, yaw]), np.sin([roll, pitch, yaw])
    about_x = np.array([[1, 0, 0], [0, cr, -sr], [0, sr, cr]])
    about_y = np.array([[cp, 0, sp], [0, 1, 0], [-sp, 0, cp]])
    about_z = np.array([[cy, -sy, 0], [sy, cy, 0], [0, 0, 1]])
    return about_z @ about_y @ about_x
