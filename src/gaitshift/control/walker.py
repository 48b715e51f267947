"""One gait at work: what robots in it observe, what an action means, how their machine moves on.

Training (`sim.env.GaitEnv`) and running (`control.Driver`) both walk by it, so they cannot differ.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Float32, Int

from gaitshift.control.observation import GaitState, Observation
from gaitshift.gait import RewardMachine, Step
from gaitshift.robot.command import ACTION_LIMIT, Command
from gaitshift.robot.state import Proprioception


@dataclass(frozen=True, kw_only=True)
class Walker:
    """N robots in one gait; what they remember comes in and goes out as a `GaitState`."""

    machine: RewardMachine
    """The gait."""
    observation: Observation
    """What its policy sees."""
    action_scale: float
    """Joint target = stance + action_scale · action [rad]."""

    def begin(
        self, sensed: Proprioception, machine_state: Int[np.ndarray, " N"] | None = None
    ) -> GaitState:
        """Robots that have not acted yet, every foot taken as it stands.

        `machine_state` is where their machines begin; None: in the initial state.
        """
        n = len(sensed.contact)
        state = np.full(n, self.machine.initial) if machine_state is None else machine_state
        return GaitState(
            machine_state=state,
            steps_in_state=np.zeros(n, dtype=np.int64),
            last_action=np.zeros((n, 12)),
            touch_height=sensed.foot_height.copy(),
        )

    def observe(
        self, state: GaitState, sensed: Proprioception, command: Command
    ) -> Float32[np.ndarray, "N D"]:
        """What the policy sees."""
        return self.observation(state, sensed, command)

    def target(
        self, action: Float[np.ndarray, "N 12"]
    ) -> tuple[Float[np.ndarray, "N 12"], Float[np.ndarray, "N 12"]]:
        """The action within its limits, and the joint targets that it means [rad]."""
        clipped = np.clip(np.asarray(action, dtype=np.float64), -ACTION_LIMIT, ACTION_LIMIT)
        return clipped, self.observation.stance_angles + self.action_scale * clipped

    def step(
        self,
        state: GaitState,
        action: Float[np.ndarray, "N 12"],
        sensed: Proprioception,
        command: Command,
    ) -> tuple[GaitState, Step]:
        """State after the control step in which robots did `action` under `command`.

        `sensed` is what they sense at its end. Also what the machine did, for the reward.
        """
        step = self.machine.step(
            state.machine_state,
            sensed.contact,
            state.steps_in_state,
            dwell=self.machine.dwell_for(command.stride),
        )
        after = GaitState(
            machine_state=step.state,
            steps_in_state=np.where(step.changed, 0, state.steps_in_state + 1),
            last_action=action,
            touch_height=np.where(sensed.contact, sensed.foot_height, state.touch_height),
        )
        return after, step
