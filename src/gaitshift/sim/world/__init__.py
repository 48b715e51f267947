"""N robots on a terrain: joint targets in, `Proprioception` and `Privileged` out."""

from gaitshift.sim.world.divergence import Divergence as Divergence
from gaitshift.sim.world.model import FIDELITIES as FIDELITIES
from gaitshift.sim.world.model import Fidelity as Fidelity
from gaitshift.sim.world.model import build_model as build_model
from gaitshift.sim.world.randomisation import Randomisation as Randomisation
from gaitshift.sim.world.world import World as World
