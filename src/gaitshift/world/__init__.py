"""N robots on a terrain: joint targets in, `Motion` out."""

from gaitshift.world.push import PushConfig as PushConfig
from gaitshift.world.push import Pusher as Pusher
from gaitshift.world.scene import build_model as build_model
from gaitshift.world.world import World as World
