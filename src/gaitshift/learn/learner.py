"""rsl_rl's PPO on a `GaitEnv`: one object that collects data and learns, one iteration a call."""

from itertools import chain
from math import isfinite
from typing import Any, cast

import numpy as np
import torch
from rsl_rl.algorithms import PPO
from rsl_rl.models import MLPModel
from rsl_rl.storage import RolloutStorage
from tensordict import TensorDict

from gaitshift.control.observation import JOINT_MIRROR
from gaitshift.errors import GaitshiftError
from gaitshift.learn.normalization import RangeNormalization
from gaitshift.learn.ppo import Mirror, WholeUpdatePPO
from gaitshift.learn.recipe import Recipe
from gaitshift.robot.command import CONTROL_PERIOD
from gaitshift.sim.env import GaitEnv
from gaitshift.sim.env.privileged import privileged_mirror

_GROUPS = {"actor": ["policy"], "critic": ["policy"]}
"""Actor and critic see the same observation (paper IV-A)."""

_PRIVILEGED_GROUPS = {"actor": ["policy"], "critic": ["policy", "privileged"]}
"""The critic also sees what only a simulation knows."""


def as_tensors(observation: np.ndarray, privileged: np.ndarray | None = None) -> TensorDict:
    """An observation, and what the critic sees beside it, in rsl_rl's form."""
    groups = {"policy": torch.from_numpy(observation)}
    if privileged is not None:
        groups["privileged"] = torch.from_numpy(privileged)
    return TensorDict(groups, batch_size=[len(observation)])


class DivergedError(GaitshiftError):
    """A training diverged: its weights, actions or figures are not finite."""


class Learner:
    """Actor, critic and PPO for one environment."""

    def __init__(self, env: GaitEnv, recipe: Recipe) -> None:
        self.env = env
        self.recipe = recipe
        self._observation = self._seen(env.reset()[0])
        self.ppo = _build_ppo(env, recipe, self._observation)
        self.totals: dict[str, float] = {}

    def start_episodes(self, seed: int) -> None:
        """Restarts all robots from a seed, with episodes of different ages."""
        observation, _ = self.env.reset(seed=seed)
        self.env.spread_ages()
        self._observation = self._seen(observation)

    def iterate(self) -> dict[str, float]:
        """Collects one batch, learns from it, and returns the means of the batch.

        Raises:
            DivergedError: weights, actions or figures are not finite.
        """
        try:
            seen = self._collect_and_update()
        except (ArithmeticError, RuntimeError, ValueError):
            self._check_weights()  # torch's own error is less clear
            raise
        self._check_weights()
        for name, value in seen.items():
            if not isfinite(value):
                raise DivergedError(f"training diverged: {name} is {value}")
        return seen

    def _collect_and_update(self) -> dict[str, float]:
        self.ppo.train_mode()
        statistics = _Statistics()
        # A second thread of torch waits for work by spinning, and so would hold up the physics.
        torch.set_num_threads(1)
        with torch.inference_mode():
            for _ in range(self.recipe.steps):
                self._collect(statistics)
            self.ppo.compute_returns(self._observation)
        torch.set_num_threads(self.recipe.threads)
        losses = self.ppo.update()
        return {
            **statistics.means(),
            "value_loss": losses["value"],
            "action_std": float(self.ppo.actor.output_std.detach().mean()),
            "learning_rate": self.ppo.learning_rate,
        }

    def aim(
        self, *, desired_kl: float, entropy: float, horizon: float = 1.0, trace: float = 1.0
    ) -> None:
        """Sets factors on the desired KL, the entropy bonus, 1 / (1 - γ) and 1 / (1 - λ)."""
        config = self.recipe.ppo
        self.ppo.desired_kl = desired_kl * config.desired_kl
        self.ppo.entropy_coef = entropy * config.entropy
        self.ppo.gamma = 1.0 - (1.0 - config.discount) / horizon
        self.ppo.lam = 1.0 - (1.0 - config.gae_lambda) / trace

    def _seen(self, observation: np.ndarray) -> TensorDict:
        """What actor and critic see now."""
        privileged = self.env.privileged() if self.recipe.env.privileged else None
        return as_tensors(observation, privileged)

    def _check_weights(self) -> None:
        for network, model in (("actor", self.ppo.actor), ("critic", self.ppo.critic)):
            for name, weights in model.named_parameters():
                if not weights.isfinite().all():
                    raise DivergedError(f"training diverged: {name} of the {network} is not finite")

    def _collect(self, statistics: "_Statistics") -> None:
        ppo, scale = self.ppo, self.recipe.ppo.reward_scale
        action = ppo.act(self._observation)
        if action.isnan().any():
            raise DivergedError("training diverged: an action is not a number")
        observation, reward, terminated, truncated, info = self.env.step(action.numpy())
        statistics.add(reward, terminated, truncated, info)
        rewards = torch.from_numpy(scale * reward).float()
        if truncated.any():
            # A truncated episode has no end: its last reward gets the value of the final state.
            known = info.get("final_privileged")
            known = None if known is None else known[truncated]
            final = as_tensors(info["final_obs"][truncated], known)
            rewards[torch.from_numpy(truncated)] += ppo.gamma * ppo.critic(final).squeeze(1)
        self._observation = self._seen(observation)
        done = torch.from_numpy(terminated | truncated)
        ppo.process_env_step(self._observation, rewards, done, {})


class _Statistics:
    """Means over an iteration of the environment's outputs at each step."""

    def __init__(self) -> None:
        self._sums: dict[str, float] = {}
        self._steps = 0
        self._diverged = 0

    def add(
        self,
        reward: np.ndarray,
        terminated: np.ndarray,
        truncated: np.ndarray,
        info: dict[str, Any],
    ) -> None:
        """Adds one step of all robots."""
        self._diverged += int(info["diverged"].sum())
        seen = {
            "reward": reward,
            "reward/bonus": info["bonus"],
            "speed": info["forward_speed"],
            "falls": terminated,
            "changes_per_s": info["changed"] / CONTROL_PERIOD,
            "stance_fraction": info["shows_stance"],
            **{f"reward/{name}": term for name, term in info["reward_terms"].items()},
        }
        for name, value in seen.items():
            self._sums[name] = self._sums.get(name, 0.0) + float(np.mean(value))
        self._steps += 1

    def means(self) -> dict[str, float]:
        """Mean of each quantity.

        `survival` is the probability of no fall in 10 s at the present rate of falls. `diverged` is
        not a mean but the number of robots whose simulation diverged, which count as falls.
        """
        means = {name: total / self._steps for name, total in self._sums.items()}
        means["survival"] = float((1.0 - means.pop("falls")) ** 1000)
        means["diverged"] = float(self._diverged)
        return means


def _build_ppo(env: GaitEnv, recipe: Recipe, observation: TensorDict) -> PPO:
    config = recipe.ppo
    network: dict[str, Any] = {
        "hidden_dims": config.hidden,
        "activation": "lrelu",
        "obs_normalization": config.normalize_observations,
    }
    distribution: dict[str, Any] = {
        "class_name": "GaussianDistribution",
        "init_std": config.initial_std,
        "std_range": (0.05, 2.0),
    }
    groups = _PRIVILEGED_GROUPS if recipe.env.privileged else _GROUPS
    actor = MLPModel(observation, groups, "actor", 12, **network, distribution_cfg=distribution)
    with torch.no_grad():  # so the first actions are close to the stance
        cast(torch.nn.Linear, actor.mlp[-1]).weight.mul_(config.output_gain)
    critic = MLPModel(observation, groups, "critic", 1, **network)
    if config.normalize_observations and config.normalize_commands == "range":
        for model in (actor, critic):
            model.obs_normalizer = RangeNormalization(model.obs_dim, env.observed_commands())
    storage = RolloutStorage("rl", env.num_envs, recipe.steps, observation, [12], "cpu")
    is_symmetric = config.mirror and env.machine.mirrored_states() is not None
    mirror = _mirror(env) if is_symmetric else None
    per_update = config.adapts == "update"
    ppo = (WholeUpdatePPO if per_update else PPO)(
        actor,
        critic,
        storage,
        num_learning_epochs=config.epochs,
        num_mini_batches=config.mini_batches,
        clip_param=config.clip,
        gamma=config.discount,
        lam=config.gae_lambda,
        entropy_coef=config.entropy,
        use_clipped_value_loss=config.clip_values,
        learning_rate=config.learning_rate,
        schedule="adaptive" if config.desired_kl > 0 else "fixed",
        desired_kl=config.desired_kl,
        symmetry_cfg=_symmetry(mirror) if mirror and not per_update else None,
    )
    if isinstance(ppo, WholeUpdatePPO):
        ppo.mirror = mirror
    if config.fused_adam:
        weights = chain(actor.parameters(), critic.parameters())
        ppo.optimizer = torch.optim.Adam(weights, lr=config.learning_rate, fused=True)
    return ppo


def _mirror(env: GaitEnv) -> Mirror:
    """What a mirror makes of the environment's observations and actions."""
    order, signs = env.walker.observation.mirror
    privileged_order, privileged_signs = privileged_mirror()
    joint_order, joint_signs = JOINT_MIRROR
    return Mirror(
        order=torch.from_numpy(order),
        signs=torch.from_numpy(signs),
        privileged_order=torch.tensor(privileged_order),
        privileged_signs=torch.tensor(privileged_signs, dtype=torch.float32),
        joint_order=torch.tensor(joint_order),
        joint_signs=torch.tensor(joint_signs, dtype=torch.float32),
    )


def _symmetry(mirror: Mirror) -> dict[str, Any]:
    """rsl_rl's augmentation: each batch followed by its mirror image."""

    def augment(
        env: Any, obs: TensorDict | None, actions: torch.Tensor | None
    ) -> tuple[TensorDict | None, torch.Tensor | None]:
        if obs is not None:
            image_of = {"policy": mirror.observation, "privileged": mirror.privileged}
            both = {
                name: torch.cat([seen, image_of[name](seen)])
                for name, seen in cast("dict[str, torch.Tensor]", obs).items()
            }
            obs = TensorDict(both, batch_size=[2 * len(obs)])
        if actions is not None:
            actions = torch.cat([actions, mirror.action(actions)])
        return obs, actions

    return {"env": None, "data_augmentation_func": augment, "use_data_augmentation": True}
