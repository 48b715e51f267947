"""The product S × U as a `gymnasium.vector.VectorEnv`, and its Gymnasium ids.

`gymnasium.make_vec("gaitshift.sim.env:gaitshift/trot-v0", num_envs=64)` works for every gait
after `import gymnasium` alone, and so does `gymnasium.make`: Gymnasium imports the module before
the colon. After `import gaitshift.sim.env` the id needs no module. (Gymnasium 1.0 removed the entry
points by which installed packages registered their environments.)
"""

from gaitshift.sim.env.config import Curriculum as Curriculum
from gaitshift.sim.env.config import EnvConfig as EnvConfig
from gaitshift.sim.env.gait_env import GaitEnv as GaitEnv
from gaitshift.sim.env.registry import SingleGaitEnv as SingleGaitEnv
from gaitshift.sim.env.registry import register_gaits as register_gaits

register_gaits()
