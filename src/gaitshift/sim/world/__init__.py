"""N robots on a terrain: joint targets in, `Proprioception` and `Privileged` out."""

from gaitshift.sim.world.divergence import Divergence as Divergence
from gaitshift.sim.world.push import PushConfig as PushConfig
from gaitshift.sim.world.push import Pusher as Pusher
from gaitshift.sim.world.world import FIDELITIES as FIDELITIES
from gaitshift.sim.world.world import Fidelity as Fidelity
from gaitshift.sim.world.world import World as World
from gaitshift.sim.world.world import build_model as build_model
