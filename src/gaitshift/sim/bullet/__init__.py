"""The second simulator: ANYmal B's public URDF in PyBullet, with that simulator's own contacts."""

from gaitshift.sim.bullet.world import BulletWorld as BulletWorld
