"""Trains a trot with PPO in one file and torch alone, and saves it: trot_ppo.pt.

Usage: python examples/train_cleanrl_style.py [ITERATIONS]
"""

import sys

import gymnasium
import numpy as np
import torch
from torch import nn
from torch.distributions import Normal

ROBOTS, STEPS, EPOCHS, BATCHES = 64, 24, 5, 4
DISCOUNT, TRACE, CLIP, LEARNING_RATE = 0.99, 0.95, 0.2, 1e-3


def network(inputs: int, outputs: int) -> nn.Sequential:
    """Two hidden layers of 128 units."""
    return nn.Sequential(
        nn.Linear(inputs, 128), nn.ELU(), nn.Linear(128, 128), nn.ELU(), nn.Linear(128, outputs)
    )


class Agent(nn.Module):
    """Actor and critic of their own, and a standard deviation for each joint."""

    def __init__(self, observations: int, actions: int) -> None:
        super().__init__()
        self.actor = network(observations, actions)
        self.critic = network(observations, 1)
        self.log_std = nn.Parameter(torch.full((actions,), -0.7))

    def policy(self, observation: torch.Tensor) -> Normal:
        """The distribution of actions."""
        return Normal(self.actor(observation), self.log_std.exp())

    def value(self, observation: torch.Tensor) -> torch.Tensor:
        """The expected return."""
        return self.critic(observation).squeeze(-1)


def collect(env, agent: Agent, observation: torch.Tensor):
    """STEPS steps of all robots: observations, actions, their log-probabilities, λ-returns."""
    observations, actions, log_probs, values, rewards, dones = [], [], [], [], [], []
    for _ in range(STEPS):
        policy = agent.policy(observation)
        action = policy.sample()
        following, reward, terminated, truncated, info = env.step(action.numpy())
        reward = torch.from_numpy(reward).float()
        if truncated.any():  # a cut episode goes on in truth: add the value of its last state
            cut = torch.from_numpy(np.flatnonzero(truncated))
            last = np.stack(list(info["final_obs"][truncated]))
            reward[cut] += DISCOUNT * agent.value(torch.from_numpy(last).float())
        observations.append(observation)
        actions.append(action)
        log_probs.append(policy.log_prob(action).sum(-1))
        values.append(agent.value(observation))
        rewards.append(reward)
        dones.append(torch.from_numpy(terminated | truncated).float())
        observation = torch.from_numpy(following).float()
    advantage, advantages = torch.zeros(ROBOTS), []
    values.append(agent.value(observation))
    for step in reversed(range(STEPS)):
        on = DISCOUNT * (1.0 - dones[step])
        error = rewards[step] + on * values[step + 1] - values[step]
        advantage = error + on * TRACE * advantage
        advantages.insert(0, advantage)
    batch = [torch.stack(x).flatten(0, 1) for x in (observations, actions, log_probs, advantages)]
    returns = batch[3] + torch.stack(values[:-1]).flatten()
    return observation, (*batch, returns), float(torch.stack(rewards).mean())


def update(agent: Agent, optimizer: torch.optim.Optimizer, batch: tuple[torch.Tensor, ...]) -> None:
    """PPO's clipped objective over random parts of the batch."""
    for _ in range(EPOCHS):
        for part in torch.randperm(ROBOTS * STEPS).chunk(BATCHES):
            observation, action, old, advantage, returns = (x[part] for x in batch)
            advantage = (advantage - advantage.mean()) / (advantage.std() + 1e-8)
            policy = agent.policy(observation)
            ratio = (policy.log_prob(action).sum(-1) - old).exp()
            gain = torch.min(ratio * advantage, ratio.clamp(1 - CLIP, 1 + CLIP) * advantage).mean()
            value_loss = (agent.value(observation) - returns).square().mean()
            loss = 0.5 * value_loss - gain - 0.002 * policy.entropy().sum(-1).mean()
            optimizer.zero_grad()
            loss.backward()
            nn.utils.clip_grad_norm_(agent.parameters(), 1.0)
            optimizer.step()


def main(iterations: int) -> None:
    """Trains for so many iterations."""
    torch.set_num_threads(1)  # networks this small gain nothing by more
    torch.manual_seed(0)
    env = gymnasium.make_vec("gaitshift.sim.env:gaitshift/trot-v0", num_envs=ROBOTS)
    agent = Agent(env.single_observation_space.shape[0], env.single_action_space.shape[0])
    optimizer = torch.optim.Adam(agent.parameters(), LEARNING_RATE)
    observation = torch.from_numpy(env.reset(seed=0)[0]).float()
    for iteration in range(iterations):
        with torch.no_grad():
            observation, batch, reward = collect(env, agent, observation)
        update(agent, optimizer, batch)
        if (iteration + 1) % 10 == 0 or iteration + 1 == iterations:
            print(f"iteration {iteration + 1}: mean reward of a step {reward:.3f}")
    torch.save(agent.state_dict(), "trot_ppo.pt")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 300)
