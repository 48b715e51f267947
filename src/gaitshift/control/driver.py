"""Drives N robots by trained policies, each in its present gait."""

from collections.abc import Mapping, Sequence

import numpy as np
from jaxtyping import Float, Int

from gaitshift.control import policy as policies
from gaitshift.control.controller import Repertoire
from gaitshift.control.observation import GaitState
from gaitshift.control.policy import Policy
from gaitshift.errors import GaitshiftError
from gaitshift.robot.command import Command
from gaitshift.robot.description import ANYMAL_B, Robot
from gaitshift.robot.state import Proprioception

STUCK = 2.0
"""Strides without a change of state after which a new machine restarts, as at the start of an
episode, if it has not completed a cycle since the shift. Ours: a walk that starts from a fast gait
may stop on four feet in a state in which it never stood in training, and which it cannot leave."""


class Driver:
    """A policy and a machine for each gait, and the gait that each robot uses now.

    A change of gait replaces policy and machine at once (paper III-E). The new machine starts in
    the state that fits the present contacts best (ours, the paper does not say), and restarts if it
    stops before its first complete cycle (`STUCK`).
    """

    def __init__(self, policies: Mapping[str, Policy], n: int, *, start: str) -> None:
        """All n robots begin in the gait `start`, in its machine's initial state.

        Raises:
            GaitshiftError: no policy for that gait, or policies of different robots or gains.
        """
        self.policies = dict(policies)
        self._check()
        infos = [policy.info for policy in self.policies.values()]
        self.repertoire = Repertoire(
            gaits=tuple(self.policies),
            machines=tuple(policy.machine for policy in self.policies.values()),
            forward_speed=np.array([info.forward_speed for info in infos]),
            stride_frequency=np.array([info.stride_frequency for info in infos]),
            body_height=np.array([info.body_height for info in infos]),
        )
        self.n = n
        first = self.repertoire.index(start)
        self.gait: Int[np.ndarray, " N"] = np.full(n, first)
        self.state = GaitState(
            machine_state=np.full(n, self.repertoire.machines[first].initial),
            steps_in_state=np.zeros(n, dtype=np.int64),
            last_action=np.zeros((n, 12)),
            touch_height=np.full((n, 4), np.nan),  # until feet are seen
        )
        """State of each robot in its gait."""
        # Changes of state until a machine that a shift began has gone round once.
        self._changes_due: Int[np.ndarray, " N"] = np.zeros(n, dtype=np.int64)
        self._acted_on: list[tuple[Policy, Int[np.ndarray, " K"], np.ndarray]] = []

    @classmethod
    def load(cls, gaits: Sequence[str], n: int, *, robot: Robot | None = None) -> "Driver":
        """A driver with shipped policies of these gaits, or policy files; it begins in the first.

        `robot` is the robot of the policies; None: ANYmal B.
        """
        loaded = [policies.load(gait, robot or ANYMAL_B) for gait in dict.fromkeys(gaits)]
        return cls({policy.gait: policy for policy in loaded}, n, start=loaded[0].gait)

    @property
    def machine_state(self) -> Int[np.ndarray, " N"]:
        """State of each robot's machine."""
        return self.state.machine_state

    @property
    def robot(self) -> Robot:
        """The robot that all policies were trained for."""
        return next(iter(self.policies.values())).robot

    @property
    def gains(self) -> str:
        """The preset of joint gains that all policies were trained with."""
        return next(iter(self.policies.values())).info.gains

    def see(self, sensed: Proprioception, command: Command) -> None:
        """Updates every robot's machine by the contacts after the step that ended.

        `command` is the command during the step.
        """
        self._see_feet(sensed)
        for index, ids in self.repertoire.groups(self.gait):
            policy, whole = self.policies[self.repertoire.gaits[index]], len(ids) == self.n
            before = self.state if whole else self.state.robots(ids)
            felt, asked = (sensed, command) if whole else (sensed.robots(ids), command.of(ids))
            asked = policy.within(asked)
            after, step = policy.walker.step(before, before.last_action, felt, asked)
            self.state = after if whole else self.state.with_robots(ids, after)
            self._changes_due[ids] -= step.changed
            stood = after.steps_in_state > STUCK * asked.stride
            is_stuck = (self._changes_due[ids] > 0) & stood
            if is_stuck.any():
                self._begin(ids[is_stuck], index, policy.machine.initial)

    def switch(self, ids: Int[np.ndarray, " K"], gait: str, sensed: Proprioception) -> None:
        """Changes the gait of robots `ids` at once; robots already in it are not affected."""
        index = self.repertoire.index(gait)
        ids = ids[self.gait[ids] != index]
        self.gait[ids] = index
        self._begin(ids, index, self.repertoire.machines[index].enter(sensed.contact[ids]))

    def _begin(
        self, ids: Int[np.ndarray, " K"], index: int, state: Int[np.ndarray, " K"] | int
    ) -> None:
        """Sets the machines of these robots, of gait number `index`, to a state."""
        machine_state, steps = self.state.machine_state.copy(), self.state.steps_in_state.copy()
        machine_state[ids], steps[ids] = state, 0
        self.state = self.state.having(machine_state=machine_state, steps_in_state=steps)
        self._changes_due[ids] = len(self.repertoire.machines[index].states)

    def act(self, sensed: Proprioception, command: Command) -> Float[np.ndarray, "N 12"]:
        """Joint targets [rad] for the next control step."""
        self._see_feet(sensed)
        target, last_action = np.empty((self.n, 12)), np.empty((self.n, 12))
        self._acted_on = []
        for index, ids in self.repertoire.groups(self.gait):
            policy, whole = self.policies[self.repertoire.gaits[index]], len(ids) == self.n
            state = self.state if whole else self.state.robots(ids)
            felt, asked = (sensed, command) if whole else (sensed.robots(ids), command.of(ids))
            asked = policy.within(asked)
            observation = policy.walker.observe(state, felt, asked)
            self._acted_on.append((policy, ids, observation))
            last_action[ids], target[ids] = policy.walker.target(policy(observation))
        self.state = self.state.having(last_action=last_action)
        return target

    def value(self) -> Float[np.ndarray, " N"] | None:
        """Values of the policies' critics at the last observations; None without critics."""
        value = np.full(self.n, np.nan)
        for policy, ids, observation in self._acted_on:
            if not policy.has_critic:
                return None
            value[ids] = policy.value(observation)
        return value

    def _see_feet(self, sensed: Proprioception) -> None:
        """Sets unknown touch heights to the present foot heights."""
        height = self.state.touch_height
        if np.isnan(height).any():
            height = np.where(np.isnan(height), sensed.foot_height, height)
            self.state = self.state.having(touch_height=height)

    def _check(self) -> None:
        named = [(gait, policy.info) for gait, policy in self.policies.items()]
        for gait, info in named:
            first_gait, first = named[0]
            if (info.robot, info.gains) != (first.robot, first.gains):
                raise GaitshiftError(
                    f"policies must be of one robot and its gains, got {info.robot} with gains "
                    f"'{info.gains}' for {gait}, {first.robot} with gains '{first.gains}' for "
                    f"{first_gait}"
                )
