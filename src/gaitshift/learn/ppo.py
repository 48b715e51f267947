"""PPO whose learning rate follows the KL divergence of whole updates, on rsl_rl's networks."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, cast

import torch
from rsl_rl.algorithms import PPO
from rsl_rl.modules import GaussianDistribution


@dataclass(frozen=True)
class Mirror:
    """Left and right changed, in observations and in actions."""

    order: torch.Tensor
    """For each part of the image of an observation the part of the observation itself."""
    signs: torch.Tensor
    """Factors of 1 or -1 on the parts of the image."""
    privileged_order: torch.Tensor
    """As `order`, for what the critic alone sees."""
    privileged_signs: torch.Tensor
    """As `signs`, for what the critic alone sees."""
    joint_order: torch.Tensor
    """As `order`, for actions."""
    joint_signs: torch.Tensor
    """As `signs`, for actions."""

    def observation(self, seen: torch.Tensor) -> torch.Tensor:
        """The images of observations (..., D)."""
        return self.signs * seen[..., self.order]

    def privileged(self, seen: torch.Tensor) -> torch.Tensor:
        """The images of what the critic alone sees (..., P)."""
        return self.privileged_signs * seen[..., self.privileged_order]

    def action(self, action: torch.Tensor) -> torch.Tensor:
        """The images of actions (..., 12)."""
        return self.joint_signs * action[..., self.joint_order]


FAR = 2.0
"""An update ends early once its KL divergence exceeds this multiple of the desired one; ours."""

NEAR = 1.5
"""The learning rate changes after an update whose KL divergence differs from the desired one by
more than this factor; ours."""

RATE_STEP = 1.5
"""Factor by which the learning rate changes; that of rsl_rl."""

RATES = (1e-5, 1e-2)
"""Smallest and largest learning rate; those of rsl_rl."""


class WholeUpdatePPO(PPO):
    """rsl_rl's PPO with another update, and with the same checkpoints.

    rsl_rl changes the learning rate at every mini-batch by the KL divergence since the update's
    beginning. This divergence stays above the desired one for the rest of an update, so the rate
    falls towards its least value, and most of an update's mini-batches change nothing. Here an
    update has one rate, ends where it has gone too far, and changes the rate of the next one.
    Observations are normalised and mirrored once, not at every mini-batch.
    """

    mirror: Mirror | None = None
    """If given, each mini-batch is followed by its mirror image."""

    def update(self) -> dict[str, float]:
        """Learns from the storage and clears it; returns the mean value loss as `value`."""
        samples = self._samples()
        self._set_rate(self.learning_rate)
        value_losses: list[float] = []
        part: dict[str, torch.Tensor] = {}
        for rows in self._parts(len(samples["observation"])):
            part = {name: values[rows] for name, values in samples.items()}
            self._see(part)
            if value_losses and self._is_adaptive and self._excess(part) > FAR:
                break
            turn = len(value_losses) % part["observation"].shape[1]
            loss, value_loss = self._losses(part, turn)
            self.optimizer.zero_grad()
            loss.backward()
            for model in (self.actor, self.critic):
                torch.nn.utils.clip_grad_norm_(model.parameters(), self.max_grad_norm)
            self.optimizer.step()
            value_losses.append(value_loss)
        if self._is_adaptive:
            with torch.no_grad():
                self._see(part)
            self._set_rate(adapted(self.learning_rate, self._excess(part)))
        seen = cast(Any, self.storage).observations.flatten(0, 1)
        self.actor.update_normalization(seen)
        self.critic.update_normalization(seen)
        self.storage.clear()
        return {"value": sum(value_losses) / len(value_losses)}

    @property
    def _desired(self) -> float:
        return float(self.desired_kl or 0.0)

    @property
    def _is_adaptive(self) -> bool:
        return self._desired > 0 and self.schedule == "adaptive"

    def _set_rate(self, rate: float) -> None:
        """Sets the learning rate, also where a checkpoint keeps it."""
        self.learning_rate = rate
        for group in cast("list[dict[str, Any]]", self.optimizer.param_groups):
            group["lr"] = rate

    def _samples(self) -> dict[str, torch.Tensor]:
        """All samples of the storage by name, one a row.

        `observation` and `judged`, which the critic sees, both normalised, and `action` are
        (n, 2, …): the sample and its mirror image; or (n, 1, …) without a mirror.
        """
        store = cast(Any, self.storage)
        samples = store.observations.flatten(0, 1)
        observation = samples["policy"]
        action = store.actions.flatten(0, 1)
        mean, std = (part.flatten(0, 1) for part in store.distribution_params)
        seen, done = [observation], [action]
        if self.mirror is not None:
            seen.append(self.mirror.observation(observation))
            done.append(self.mirror.action(action))
        both = torch.stack(seen, 1)
        normalised = cast(Any, self.actor).obs_normalizer(both)
        judged = normalised
        if (privileged := samples.get("privileged", None)) is not None:
            known = [privileged]
            if self.mirror is not None:
                known.append(self.mirror.privileged(privileged))
            judged = torch.cat((both, torch.stack(known, 1)), dim=-1)
            judged = cast(Any, self.critic).obs_normalizer(judged)
        return {
            "observation": normalised,
            "judged": judged,
            "action": torch.stack(done, 1),
            "advantage": store.advantages.flatten(),
            "return": store.returns.flatten(),
            "log_prob": store.actions_log_prob.flatten(),
            "mean": mean,
            "std": std,
        }

    def _parts(self, samples: int) -> Iterator[torch.Tensor]:
        """The rows of each mini-batch."""
        size = samples // self.num_mini_batches
        for _ in range(self.num_learning_epochs):
            yield from torch.randperm(samples).split(size)[: self.num_mini_batches]

    @property
    def _distribution(self) -> GaussianDistribution:
        """The distribution of actions at the observations that were seen last."""
        return cast(GaussianDistribution, self.actor.distribution)

    def _see(self, part: dict[str, torch.Tensor]) -> None:
        """Shows the actor the observations of a mini-batch."""
        self._distribution.update(self.actor.mlp(part["observation"]))

    def _excess(self, part: dict[str, torch.Tensor]) -> float:
        """KL divergence from the update's beginning over the desired one, at a seen mini-batch."""
        with torch.no_grad():
            now = self._distribution.mean[:, 0], self._distribution.std[:, 0]
            divergence = self._distribution.kl_divergence((part["mean"], part["std"]), now)
        return divergence.mean().item() / self._desired

    def _losses(self, part: dict[str, torch.Tensor], turn: int) -> tuple[torch.Tensor, float]:
        """The loss of a seen mini-batch, and its value loss.

        The actor learns from samples and their images, the critic from either in turn: trainings
        then take as many iterations, and an update a quarter less time.
        """
        value = self.critic.mlp(part["judged"][:, turn]).squeeze(-1)
        log_prob = self._distribution.log_prob(part["action"])
        ratio = torch.exp(log_prob - part["log_prob"][:, None])
        clipped = ratio.clamp(1.0 - self.clip_param, 1.0 + self.clip_param)
        advantage = part["advantage"][:, None]
        surrogate = -torch.minimum(advantage * ratio, advantage * clipped).mean()
        value_loss = (part["return"] - value).pow(2).mean()
        entropy = self._distribution.entropy.mean()
        loss = surrogate + self.value_loss_coef * value_loss - self.entropy_coef * entropy
        return loss, value_loss.item()


def adapted(rate: float, excess: float) -> float:
    """The next learning rate after an update with this KL divergence over the desired one."""
    if excess > NEAR:
        rate /= RATE_STEP
    elif excess < 1.0 / NEAR:
        rate *= RATE_STEP
    return min(max(rate, RATES[0]), RATES[1])
