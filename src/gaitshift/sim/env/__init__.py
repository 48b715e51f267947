"""The product S × U as a `gymnasium.vector.VectorEnv`, and the ids by which Gymnasium knows it.

After `import gaitshift.sim.env`, `gymnasium.make_vec("gaitshift/trot-v0", num_envs=64)` and
`gymnasium.make("gaitshift/trot-v0")` work for every shipped gait.
"""

from gaitshift.sim.env.config import EnvConfig as EnvConfig
from gaitshift.sim.env.gait_env import GaitEnv as GaitEnv
from gaitshift.sim.env.registry import register_gaits as register_gaits
from gaitshift.sim.env.single import SingleGaitEnv as SingleGaitEnv

register_gaits()
