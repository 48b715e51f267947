"""Swings: touchdowns out of place by hand tables, and the bonus that swings and timing earn."""

import numpy as np
import pytest

from gaitshift.gait import gaits
from gaitshift.sim.env import Curriculum, EnvConfig, GaitEnv
from gaitshift.sim.reward import RewardConfig
from hopping import (
    FEET,
    FLAT,
    HOP,
    UNHURRIED,
    arbitrary_actions,
    feed,
    keep_steps,
    with_swing_height,
)

CHATTER = [
    # Feet down of a trotting robot, and how many of them came down once too often.
    ("", 0),
    ("FL FR BL BR", 0),  # every foot may land once in an episode before it is lifted
    ("FL BR", 0),
    ("FL BL BR", 1),  # BL was not lifted: the machine still waits in FL_BR
    *(("FL BR", 0),) * 20,
    ("FR BL", 2),  # FR and BL again; now the machine changes, and has lifted FL and BR
    ("FR", 0),
    ("FL FR BL", 1),  # FL may land, BL not
    ("FR BL", 0),
    ("FL FR BL", 1),  # FL has landed already
    *(("FR BL", 0),) * 20,
    ("FL BR", 1),  # BR may land, FL has; the machine changes and has lifted FR and BL
    *(("FL BR", 0),) * 20,
    ("FR BL", 0),
]
WALK_CHATTER = [
    # The same of a walking robot: the machine lifts FL, BR, FR, BL in turn.
    ("FR BL BR", 0),
    *(("FR BL BR", 0),) * 20,
    ("FL FR BL", 0),  # FL lands, and BR is lifted
    *(("FL FR BL", 0),) * 20,
    ("FL BL BR", 0),  # BR lands, and FR is lifted
    *(("FL BL BR", 0),) * 20,
    ("FL FR BR", 0),  # FR lands, and BL is lifted
    ("FR BR", 0),
    ("FL FR BR", 1),  # FL has landed already
]
EARLY = [
    # The same of a galloping robot: BR, BL, FR, FL in turn.
    ("BR", 0),
    ("BR FR", 1),  # two states too early
    *(("BR", 0),) * 12,
    ("BL", 0),
    *(("BL", 0),) * 14,
    ("BL FR", 0),  # the next one, before the machine changes
    ("FR", 0),
    ("FR BL", 1),  # lifted, but not due
    *(("FR", 0),) * 12,
    ("FL", 0),
]


@pytest.mark.parametrize("strictness", [0.0, 0.25, 1.0])
@pytest.mark.parametrize(
    ("gait", "table"), [("trot", CHATTER), ("walk", WALK_CHATTER), ("gallop", EARLY)]
)
def test_feet_that_come_down_out_of_place_are_paid_for(gait, table, strictness, monkeypatch):
    config = EnvConfig(command_share=0.0)
    env = GaitEnv(gaits.load(gait), FLAT, 2, config=config, threads=1)
    env.reset(seed=0)
    env.curriculum = Curriculum(strictness=strictness)
    contact = feed(env, monkeypatch)
    for feet, again in table:
        contact[:] = [foot in feet.split() for foot in FEET]
        *_, info = env.step(np.zeros((2, 12)))
        paid = env.config.reward.chatter * strictness * again
        np.testing.assert_allclose(info["reward_terms"]["chatter"], paid, err_msg=feet)


@pytest.mark.parametrize("strictness", [0.0, 0.25, 1.0])
def test_strictness_is_how_far_the_bonus_depends_on_the_swing(strictness, monkeypatch):
    asked, step = 0.2, []
    config = EnvConfig(reward=RewardConfig(bonus_punctuality=0.0))
    envs = [
        GaitEnv(with_swing_height(height), FLAT, 4, config=config, threads=1)
        for height in (0.0, asked)
    ]
    for env in envs:
        env.curriculum = Curriculum(strictness=strictness)
        env.reset(seed=0)
    steps = keep_steps(envs[1], monkeypatch)
    swing = np.full((4, 2), np.inf)  # of FL and FR, which land in turn
    state = envs[1].walker.observation.slices["machine_state"].start
    for action in arbitrary_actions(2, 150, 4, size=1.5):
        (_, free, *_), (seen, paid, *_, info) = (env.step(action) for env in envs)
        swing = np.maximum(swing, steps[-1][1].clearance[:, :2])
        for robot in np.flatnonzero(info["changed"]):
            entered = int(seen[robot, state] == 0.0)  # it stands on this one of the two now
            share = np.clip(swing[robot, entered] / asked, 0.0, 1.0)
            full = env.config.reward.bonus * HOP.edges[1 - entered].bonus
            lost = strictness * (1.0 - share) * full
            assert free[robot] - paid[robot] == pytest.approx(lost, abs=1e-9)
            step.append(share)
            swing[robot, 1 - entered] = steps[-1][1].clearance[robot, 1 - entered]
    assert len([share for share in step if 0 < share < 1]) > 5


def test_a_swing_factor_is_higher_swings_asked_for():
    envs = [
        GaitEnv(with_swing_height(height), FLAT, 4, config=EnvConfig(), threads=1)
        for height in (0.2, 0.3)
    ]
    envs[0].curriculum = Curriculum(swing_factor=1.5)
    for env in envs:
        env.reset(seed=0)
    partly = 0
    for action in arbitrary_actions(2, 100, 4, size=1.5):
        (_, by_factor, *_), (_, by_machine, *_, info) = (env.step(action) for env in envs)
        np.testing.assert_allclose(by_factor, by_machine, atol=1e-9)
        partly += np.count_nonzero(
            info["changed"] & (info["bonus"] < 0.5 * envs[0].config.reward.bonus)
        )
    assert partly > 5


def test_a_stance_factor_weighs_whole_stances_as_another_weight_does():
    weight = RewardConfig().stance_pattern
    config = EnvConfig(reward=RewardConfig(stance_pattern=2.5 * weight))
    envs = [
        GaitEnv(gaits.load("trot"), FLAT, 4, config=c, threads=1) for c in (EnvConfig(), config)
    ]
    envs[0].curriculum = Curriculum(stance_factor=2.5)
    for env in envs:
        env.reset(seed=0)
    shown = 0
    for action in arbitrary_actions(2, 100, 4, size=0.2):
        (_, by_factor, *_), (_, by_weight, *_, info) = (env.step(action) for env in envs)
        np.testing.assert_allclose(by_factor, by_weight, atol=1e-9)
        shown += np.count_nonzero(info["reward_terms"]["stance_pattern"])
    assert shown > 5


@pytest.mark.parametrize("strictness", [0.0, 0.25, 1.0])
def test_a_late_change_earns_less_of_the_bonus(strictness):
    """Against an env that does not ask: full until 2 steps late, nothing half a dwell after it."""
    seen = []
    envs = [
        GaitEnv(
            UNHURRIED,
            FLAT,
            16,
            config=EnvConfig(reward=RewardConfig(bonus_punctuality=weight)),
            threads=1,
        )
        for weight in (0.0, 1.0)
    ]
    for env in envs:
        env.curriculum = Curriculum(strictness=strictness)
        env.reset(seed=0)
    waited = np.zeros(16, dtype=int)
    for action in arbitrary_actions(2, 300, 16, size=1.5):
        (_, free, *_), (_, paid, ended, cut, info) = (env.step(action) for env in envs)
        waited += 1
        for robot in np.flatnonzero(info["changed"]):
            late = max(waited[robot] - 8 - 2, 0)
            lost = strictness * min(late / 4, 1.0) * envs[0].config.reward.bonus
            assert free[robot] - paid[robot] == pytest.approx(lost, abs=1e-9)
            seen.append(late)
        waited[info["changed"] | ended | cut] = 0
    assert min(seen) == 0
    assert {1, 2, 3} & set(seen)
    assert max(seen) > 4
