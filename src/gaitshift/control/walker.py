"""One gait in use: observations, meaning of actions, and steps of the machine.

Training (`sim.env.GaitEnv`) and running (`control.Driver`) both use it, so they cannot differ.
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
    """N robots in one gait; their state is passed in and returned as a `GaitState`."""

    machine: RewardMachine
    """The gait."""
    observation: Observation
    """The observation of its policy."""
    action_scale: float
    """Joint target = stance + action_scale · action [rad]."""

    def begin(
        self, sensed: Proprioception, machine_state: Int[np.ndarray, " N"] | None = None
    ) -> GaitState:
        """State of robots before their first action; touch heights are the present foot heights.

        `machine_state` is the first state of their machines; None: the initial state.
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
        """The observation of the policy."""
        return self.observation(state, sensed, command)

    def target(
        self, action: Float[np.ndarray, "N 12"]
    ) -> tuple[Float[np.ndarray, "N 12"], Float[np.ndarray, "N 12"]]:
        """The clipped action, and its joint targets [rad]."""
        clipped = np.clip(np.asarray(action, dtype=np.float64), -ACTION_LIMIT, ACTION_LIMIT)
        return clipped, self.observation.stance_angles + self.action_scale * clipped

    def step(
        self,
        state: GaitState,
        action: Float[np.ndarray, "N 12"],
        sensed: Proprioception,
        command: Command,
    ) -> tuple[GaitState, Step]:
        """State after the control step of `action` under `command`, and the step of the machine.

        `sensed` is the proprioception at its end. The step of the machine is for the reward.
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
