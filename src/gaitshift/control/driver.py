"""Drives N robots, each in the gait of the moment: machine, observation, policy, joint target."""

from collections.abc import Mapping

import numpy as np
from jaxtyping import Bool, Float, Int

from gaitshift.control.observation import Situation, last_touch
from gaitshift.control.policy import Policy
from gaitshift.errors import GaitshiftError
from gaitshift.robot.command import ACTION_LIMIT, Command
from gaitshift.robot.description import Robot
from gaitshift.robot.motion import Motion

STUCK = 2.0
"""Strides for which a machine that a shift began may stand still before it has gone round once;
then it begins anew as at the start of an episode. Ours: a walk that is taken up from a fast gait
may come to a stand on four feet in a state in which no episode of its training stood, and out of
which it knows no way."""


class Driver:
    """One policy and one machine a gait, and which of them each robot uses now.

    A change of gait replaces policy and machine at once (paper III-E); the new machine starts in
    the state that fits the present contacts best (ours, the paper is silent), and begins anew where
    it comes to a stand before it has gone round once (`STUCK`).
    """

    def __init__(self, policies: Mapping[str, Policy], n: int, *, start: str) -> None:
        """All n robots begin in the gait `start`, in its machine's initial state."""
        self.policies = dict(policies)
        self.gaits = tuple(self.policies)
        self._check(start)
        self.n = n
        self._machines = tuple(policy.machine for policy in self.policies.values())
        self.gait: Int[np.ndarray, " N"] = np.full(n, self.gaits.index(start))
        self.machine_state: Int[np.ndarray, " N"] = np.zeros(n, dtype=np.int64)
        self.steps_in_state: Int[np.ndarray, " N"] = np.zeros(n, dtype=np.int64)
        # Changes of state until a machine that a shift began has gone round once.
        self._changes_due: Int[np.ndarray, " N"] = np.zeros(n, dtype=np.int64)
        self._last_action: Float[np.ndarray, "N 12"] = np.zeros((n, 12))
        self._touch_height: Float[np.ndarray, "N 4"] | None = None  # until a motion is seen
        self._acted_on: list[tuple[Policy, Int[np.ndarray, " K"], np.ndarray]] = []
        self.machine_state[:] = self._machines[self.gaits.index(start)].initial

    @property
    def robot(self) -> Robot:
        """The robot that all policies were trained for."""
        return next(iter(self.policies.values())).robot

    @property
    def gains(self) -> str:
        """The preset of joint gains that all policies were trained with."""
        return next(iter(self.policies.values())).info.gains

    def see(self, motion: Motion, command: Command) -> None:
        """Moves every robot's machine on by what its feet did in the step that ended.

        `command` is the one that the robots acted on.
        """
        self._touch_height = last_touch(motion, self._touch_height)
        stride = command.stride
        for index, ids in self._groups():
            step = self._machines[index].step(
                self.machine_state[ids],
                motion.contact[ids],
                self.steps_in_state[ids],
                dwell=self._machines[index].dwell_for(stride[ids]),
            )
            self.machine_state[ids] = step.state
            self.steps_in_state[ids] = np.where(step.changed, 0, self.steps_in_state[ids] + 1)
            self._changes_due[ids] -= step.changed
            is_stuck = (self._changes_due[ids] > 0) & (
                self.steps_in_state[ids] > STUCK * stride[ids]
            )
            self._begin(ids[is_stuck], index, self._machines[index].initial)

    def switch(self, ids: Int[np.ndarray, " K"], gait: str, motion: Motion) -> None:
        """Robots `ids` take up another gait at once; those already in it are left alone."""
        self._check_known(gait)
        index = self.gaits.index(gait)
        ids = ids[self.gait[ids] != index]
        self.gait[ids] = index
        self._begin(ids, index, self._machines[index].enter(motion.contact[ids]))

    def _begin(
        self, ids: Int[np.ndarray, " K"], index: int, state: Int[np.ndarray, " K"] | int
    ) -> None:
        """The machines of these robots, of gait number `index`, begin in a state."""
        self.machine_state[ids] = state
        self.steps_in_state[ids] = 0
        self._changes_due[ids] = len(self._machines[index].states)

    def act(self, motion: Motion, command: Command) -> Float[np.ndarray, "N 12"]:
        """Joint targets [rad] for the next control step."""
        target = np.empty((self.n, 12))
        if self._touch_height is None:
            self._touch_height = last_touch(motion)
        self._acted_on = []
        for index, ids in self._groups():
            policy = self.policies[self.gaits[index]]
            whole = len(ids) == self.n
            situation = Situation(
                machine_state=self.machine_state[ids],
                steps_in_state=self.steps_in_state[ids],
                motion=motion if whole else motion.of(ids),
                command=command if whole else command.of(ids),
                last_action=self._last_action[ids],
                stance=policy.robot.stance_angles,
                touch_height=self._touch_height[ids],
            )
            observation = policy.observation(situation)
            self._acted_on.append((policy, ids, observation))
            action = policy(observation).astype(np.float64)
            action = np.clip(action, -ACTION_LIMIT, ACTION_LIMIT)
            self._last_action[ids] = action
            target[ids] = policy.target(action)
        return target

    def value(self) -> Float[np.ndarray, " N"] | None:
        """What the policies' critics expected from what robots acted on last; None without them."""
        value = np.full(self.n, np.nan)
        for policy, ids, observation in self._acted_on:
            if not policy.has_critic:
                return None
            value[ids] = policy.value(observation)
        return value

    def own_command(self) -> Command:
        """Straight ahead, at the nominal speed and stride frequency of each robot's gait."""
        speed = np.array([policy.info.forward_speed for policy in self.policies.values()])
        frequency = np.array([policy.info.stride_frequency for policy in self.policies.values()])
        return Command(
            forward_speed=speed[self.gait],
            yaw_rate=np.zeros(self.n),
            stride_frequency=frequency[self.gait],
        )

    def stance_shown(self, motion: Motion) -> Bool[np.ndarray, " N"]:
        """Whether the feet in contact are a stance set of each robot's present gait."""
        shown = np.empty(self.n, dtype=bool)
        for index, ids in self._groups():
            shown[ids] = self._machines[index].shows_stance(motion.contact[ids])
        return shown

    def _groups(self) -> list[tuple[int, Int[np.ndarray, " K"]]]:
        """Which robots use which gait, for the gaits in use."""
        first = int(self.gait[0])
        if (self.gait == first).all():
            return [(first, np.arange(self.n))]
        return [(int(index), np.flatnonzero(self.gait == index)) for index in np.unique(self.gait)]

    def _check_known(self, gait: str) -> None:
        if gait not in self.policies:
            raise GaitshiftError(f"gait must be one of {', '.join(self.gaits)}, got '{gait}'")

    def _check(self, start: str) -> None:
        self._check_known(start)
        infos = [policy.info for policy in self.policies.values()]
        for name, info in zip(self.gaits, infos, strict=True):
            if (info.robot, info.gains) != (infos[0].robot, infos[0].gains):
                raise GaitshiftError(
                    f"the policy of {name} is for {info.robot} with gains '{info.gains}', that of "
                    f"{self.gaits[0]} for {infos[0].robot} with gains '{infos[0].gains}'; "
                    "both policies must be for the same robot and gains"
                )
