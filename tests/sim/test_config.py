"""What an environment may be made of."""

import pytest

from gaitshift.errors import GaitshiftError
from gaitshift.sim.env import EnvConfig


def test_an_episode_needs_a_step_and_a_speed_that_legs_can_run():
    with pytest.raises(GaitshiftError, match="episode_steps must be 1 to 1000000, got 0"):
        EnvConfig(episode_steps=0)
    with pytest.raises(GaitshiftError, match=r"forward_speed must be 0 to 3 m/s, got -0\.1"):
        EnvConfig(forward_speed=-0.1)
    with pytest.raises(GaitshiftError, match=r"command_share must be 0 to 1, got 1\.1"):
        EnvConfig(command_share=1.1)
    with pytest.raises(GaitshiftError, match="command_interval must be 1 to 1000000, got 0"):
        EnvConfig(command_interval=0)
