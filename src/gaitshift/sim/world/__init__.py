"""N robots on a terrain: joint targets in, `Proprioception` and `Privileged` out."""

from gaitshift.sim.world.push import PushConfig as PushConfig
from gaitshift.sim.world.push import Pusher as Pusher
from gaitshift.sim.world.scene import build_model as build_model
from gaitshift.sim.world.world import World as World
