"""The ways to train: the paper's recipe, and the same with one thing changed."""

from dataclasses import dataclass, replace

from gaitshift.control.observation import PAPER_SLICES
from gaitshift.gait import RewardMachine, gaits
from gaitshift.learn.recipe import Recipe
from gaitshift.sim.reward import RewardConfig

LOCKOUT = 10
"""Control steps between two changes of state in the main runs. The paper gives none; the first
author's code for another robot has 10. The published plateau of 25 to 27 excludes 20: with b = 200
added at most every 20 steps the reward per step is at most 10 + 200 / 20 = 20."""

PAPER = "paper"
"""Name of the setting with which the others are compared."""


@dataclass(frozen=True, kw_only=True)
class Setting:
    """One way to train: a recipe, and a lock-out for the machine of any gait."""

    name: str
    """Name in the names of runs and in tables."""
    group: str
    """The question that it answers in comparison with the paper's setting."""
    label: str
    """Short description of the difference."""
    recipe: Recipe
    """Everything except the machine."""
    lockout: int = LOCKOUT
    """Least time between two changes of the machine's state [control steps]."""

    def machine(self, gait: str) -> RewardMachine:
        """The gait's machine with this lock-out and without swing heights."""
        own = gaits.load(gait)
        edges = tuple(
            replace(edge, guard=replace(edge.guard, dwell=self.lockout), swing_height=0.0)
            for edge in own.edges
        )
        return replace(
            own, edges=edges, dwell=self.lockout, dwell_range=(self.lockout, self.lockout)
        )


def _recipe(
    *,
    gains: str = "default",
    observed: tuple[str, ...] = PAPER_SLICES,
    penalty_start: float = 1.0,
    **reward: object,
) -> Recipe:
    """The paper's recipe on one core, with gains that can hold the robot up, and one change."""
    paper = Recipe.paper()
    weights: RewardConfig = replace(paper.env.reward, **reward)
    env = replace(paper.env, gains=gains, observed=observed, reward=weights)
    return replace(paper, env=env, penalty_start=penalty_start, threads=1, physics_threads=1)


_WITHOUT_MACHINE = tuple(s for s in PAPER_SLICES if s not in ("machine_state", "steps_in_state"))

REFERENCE = Setting(name=PAPER, group=PAPER, label="the paper's recipe", recipe=_recipe())

ABLATIONS = (
    Setting(
        name="multiply-clipped",
        group="bonus",
        label="max(R, 0) · b",
        recipe=_recipe(bonus_mode="multiply_clipped"),
    ),
    Setting(name="multiply", group="bonus", label="R · b", recipe=_recipe(bonus_mode="multiply")),
    Setting(name="lockout-0", group="lock-out", label="no lock-out", recipe=_recipe(), lockout=0),
    Setting(name="lockout-20", group="lock-out", label="20 steps", recipe=_recipe(), lockout=20),
    Setting(
        name="blind",
        group="observation",
        label="u and δ hidden",
        recipe=_recipe(observed=_WITHOUT_MACHINE),
    ),
    Setting(name="no-bonus", group="machine", label="b = 0", recipe=_recipe(bonus=0.0)),
    Setting(
        name="curriculum",
        group="penalties",
        label="λ grows from 0.1 to 1",
        recipe=_recipe(penalty_start=0.1),
    ),
    Setting(name="paper-gains", group="gains", label="Kp 3, Kd 0.2", recipe=_recipe(gains="paper")),
)
"""Each differs from `REFERENCE` in one setting, given by its name."""

AS_IN_THE_PAPER = {
    "bonus": "R + b",
    "lock-out": f"{LOCKOUT} steps",
    "observation": "u and δ shown",
    "machine": "b = 200",
    "penalties": "λ = 1 from the start",
    "gains": "Kp 80, Kd 2",
}
"""The reference's value of the setting of each group."""
