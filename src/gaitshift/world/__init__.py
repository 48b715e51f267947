"""N robots on a terrain: joint targets in, `Motion` out."""

from gaitshift.world.push import PushConfig, Pusher
from gaitshift.world.scene import build_model
from gaitshift.world.world import World

__all__ = ["PushConfig", "Pusher", "World", "build_model"]
