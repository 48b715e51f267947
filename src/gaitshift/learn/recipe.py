"""The recipe: everything that decides what a training run does, as data."""

from dataclasses import dataclass, field, replace
from typing import Literal

from gaitshift.data import check_ranges, known_names
from gaitshift.errors import GaitshiftError
from gaitshift.sim.env import Curriculum, EnvConfig
from gaitshift.sim.world import FIDELITIES, Fidelity


@dataclass(frozen=True, kw_only=True)
class PpoConfig:
    """Hyperparameters of PPO (Schulman et al. 2017), in rsl_rl's terms."""

    hidden: tuple[int, ...] = (256, 128, 32)
    """Hidden layers of actor and critic, each followed by a leaky ReLU (paper IV-A)."""
    epochs: int = 3
    """Passes over each batch; rsl_rl's default is 5."""
    mini_batches: int = 4
    """Mini-batches a pass; rsl_rl's default."""
    discount: float = 0.99
    """γ; 1 s at 100 Hz."""
    gae_lambda: float = 0.95
    """λ of generalised advantage estimation."""
    clip: float = 0.2
    """Clipping of the probability ratio."""
    clip_values: bool = False
    """Whether the value loss is clipped too; ours: no, since values are far larger than `clip`."""
    learning_rate: float = 1e-3
    """First learning rate; it follows `desired_kl` from there."""
    adapts: Literal["update", "mini_batch"] = "update"
    """When the learning rate follows `desired_kl`: after each update, which ends early where it
    goes too far (`WholeUpdatePPO`); or at each mini-batch, as in rsl_rl."""
    desired_kl: float = 0.03
    """KL divergence an update aims at."""
    entropy: float = 0.003
    """Weight of the entropy bonus; ours."""
    initial_std: float = 0.5
    """First standard deviation of the actions; ours."""
    output_gain: float = 0.01
    """Factor on the actor's last weights at the start; Andrychowicz et al. 2021."""
    reward_scale: float = 0.02
    """Rewards are scaled by this inside PPO alone; ours: values near 1 to 100 with b = 200."""
    normalize_observations: bool = True
    """Running mean and variance of the observations in front of both networks."""
    normalize_commands: Literal["seen", "range"] = "seen"
    """By which mean and variance commands are normalised: those of all that was seen, or those of
    their whole ranges (`RangeNormalization`)."""
    mirror: bool = True
    """Every batch is doubled by its mirror image (left and right changed), where the machine is
    symmetric; ours, after Mittal et al. 2024."""
    fused_adam: bool = False
    """Whether Adam runs as one kernel: a sixth less time with many small mini-batches, and
    different rounding."""

    def __post_init__(self) -> None:
        if not all(1 <= width <= 8192 for width in self.hidden):
            raise GaitshiftError(f"hidden must be widths of 1 to 8192, got {self.hidden}")
        check_ranges(
            self,
            epochs=(1, 1000),
            mini_batches=(1, 100_000),
            discount=(0.0, 0.99999),
            gae_lambda=(0.0, 1.0),
            clip=(0.001, 10.0),
            learning_rate=(1e-7, 1.0),
            desired_kl=(0.0, 10.0),
            entropy=(0.0, 10.0),
            initial_std=(0.05, 2.0),
            output_gain=(1e-6, 100.0),
            reward_scale=(1e-6, 1e6),
        )


FIELD_KINDS = ("flat", "perlin", "slope", "stair", "step")
"""Kinds of fields that a rough stage may have."""


def shared_out(**fields: int) -> tuple[str, ...]:
    """Kinds of fields by their numbers."""
    return tuple(kind for kind, count in fields.items() for _ in range(count))


@dataclass(frozen=True, kw_only=True)
class Stage:
    """A stretch of training on one kind of ground."""

    name: str
    """Shown in the progress and written into `progress.csv`."""
    iterations: int
    """PPO iterations."""
    fidelity: Fidelity = "exact"
    """Of the physics; a gait may be discovered in coarse physics and finished in exact physics."""
    amplitude: float = 0.0
    """Largest |height| of the Perlin grounds at the end of the stage [m]."""
    slope: float = 0.0
    """Steepest slope at the end of the stage, in any direction [degrees]."""
    stair: float = 0.0
    """Highest stairs at the end of the stage [m]."""
    step: float = 0.0
    """Highest single steps at the end of the stage [m]."""
    redraw_every: int = 5
    """Iterations between two draws of the ground (paper III-D)."""
    push: float = 0.0
    """Largest push on the base [N]."""
    mixed_starts: float = 0.0
    """Share of the episodes that start mid-stride with the legs out of phase, as after a shift from
    another gait (`Curriculum.mixed_starts`); ours, the paper does not train for shifts."""
    swing_factor: float = 1.0
    """Factor on the gait's swing heights; ours: feet that swing 14 cm high do not catch on steps;
    on level ground 10 cm is enough."""
    stance_factor: float = 1.0
    """Factor on the weight of the whole stance, `RewardConfig.stance_pattern`; ours: where it is
    large from the start, a pace does not learn to walk slowly."""
    kl_factor: float = 1.0
    """Factor on PPO's `desired_kl`; ours: on rough ground larger updates learn more."""
    entropy_factor: float = 1.0
    """Factor on PPO's `entropy`; ours: on rough ground actions become more random with it, and a
    trot costs more."""
    horizon_factor: float = 1.0
    """Factor on PPO's horizon, 1 / (1 - γ) steps; ours: a robot falls 1 to 3 s after a foot catches
    on an edge, and a horizon of 1 s is too short to learn from that."""
    trace_factor: float = 1.0
    """Factor on 1 / (1 - λ) steps, the time over which PPO assigns credit to an action; ours: with
    λ = 0.98 robots stay up on edges on which they fall with 0.95, but their steps are less clean;
    a last stage with 0.95 makes the steps clean again."""
    fields: tuple[str, ...] = shared_out(flat=3, perlin=2, slope=1, stair=3, step=3)
    """Kinds of the fields among which the robots are divided on rough ground; ours: without level
    ground among them the policy forgets the speeds and touchdowns that it learned there. With one
    field of stairs and one of steps in nine, 8 of 64 bounding robots stayed up over steps of 10 cm;
    with these, all 64 did."""
    settle: float = 0.35
    """Last share of the stage, if the run ends with it, in which the policy settles: `desired_kl`
    and `entropy` fall to a tenth; ours: without it the speed of the last policy is up to 0.2 m/s
    too high or too low."""
    averaged: float = 0.24
    """Last share of the stage, if the run ends with it, whose checkpoints' actors are averaged into
    the policy; ours: speed and success on edges vary from one checkpoint to the next, and the
    average is better than most of them (Izmailov et al. 2018). 0: the last actor alone."""

    def __post_init__(self) -> None:
        if self.fidelity not in FIDELITIES:
            raise GaitshiftError(known_names("fidelity", self.fidelity, FIDELITIES))
        check_ranges(
            self,
            iterations=(0, 1_000_000),
            amplitude=(0.0, 1.0),
            slope=(0.0, 60.0),
            stair=(0.0, 1.0),
            step=(0.0, 1.0),
            redraw_every=(1, 1_000_000),
            push=(0.0, 1000.0),
            mixed_starts=(0.0, 1.0),
            swing_factor=(0.01, 100.0),
            stance_factor=(0.01, 100.0),
            kl_factor=(0.001, 1000.0),
            entropy_factor=(0.0, 1000.0),
            horizon_factor=(0.001, 1000.0),
            trace_factor=(0.001, 1000.0),
            settle=(0.0, 1.0),
            averaged=(0.0, 1.0),
        )
        unknown = [kind for kind in self.fields if kind not in FIELD_KINDS]
        if unknown or not self.fields:
            raise GaitshiftError(
                f"fields must be some of {', '.join(FIELD_KINDS)}, got {self.fields}"
            )

    @property
    def is_rough(self) -> bool:
        """Whether any of its ground is not flat."""
        return max(self.amplitude, self.slope, self.stair, self.step) > 0


ROUGH = Stage(
    name="rough",
    iterations=470,
    amplitude=0.16,
    slope=12.0,
    stair=0.08,
    step=0.15,
    push=130.0,
    swing_factor=1.4,
    horizon_factor=2.0,
    trace_factor=2.5,
)
"""Rough ground with pushes: robots learn to stay up."""

POLISH = replace(
    ROUGH,
    name="polish",
    iterations=300,
    trace_factor=1.0,
    fields=shared_out(flat=5, perlin=2, slope=1, stair=2, step=2),
    settle=1.0,
    averaged=0.5,
    kl_factor=0.7,
)
"""The same with more level fields: the gait becomes clean again."""


@dataclass(frozen=True, kw_only=True)
class Recipe:
    """A training run: the same one for every gait."""

    env: EnvConfig = field(default_factory=EnvConfig)
    """The environment."""
    ppo: PpoConfig = field(default_factory=PpoConfig)
    """The algorithm."""
    stages: tuple[Stage, ...] = (Stage(name="flat", iterations=400), ROUGH, POLISH)
    """Flat ground, then Perlin ground with pushes (paper III-D) in two stages: the first makes the
    policy robust, the second makes the gait clean again."""
    robots: int = 128
    """Robots in parallel; ours: a core's worth of physics a step (the paper has 30)."""
    steps: int = 24
    """Control steps of each robot in an iteration; ours (the paper has 100)."""
    strict_from: int = 60
    """Iteration from which the environment's strictness grows from 0; ours: at full strictness from
    the start, swing heights and the chatter penalty keep exploration from finding the cycle."""
    strict_until: int = 210
    """Iteration at which it stops growing."""
    strict_share: float = 1.0
    """Strictness from then on; 0: none at any time, as in the paper."""
    command_from: int = 100
    """Iteration from which commands differ from the gait's own; ours: the policy learns the gait
    first, then its speeds and frequencies."""
    command_until: int = 300
    """Iteration from which commands are drawn from the gait's whole ranges."""
    penalty_start: float = 1.0
    """The factor λ on all penalties at the first iteration; 1: no curriculum (paper III-D)."""
    penalty_until: int = 200
    """Iteration at which λ has grown to 1, by the same step each iteration."""
    randomise_from: int = 100
    """Iteration from which robots differ from each other; ours: a trot that learns from different
    robots from the start stays on the spot."""
    randomise_until: int = 300
    """Iteration from which they differ by the whole ranges of `env.randomisation`."""
    checkpoint_every: int = 50
    """Iterations between two checkpoints."""
    threads: int = 2
    """Threads of torch."""
    physics_threads: int = 0
    """Threads of the physics; 0: one a core."""

    def __post_init__(self) -> None:
        check_ranges(
            self,
            robots=(1, 65536),
            steps=(1, 100_000),
            checkpoint_every=(1, 1_000_000),
            threads=(1, 1024),
            physics_threads=(0, 1024),
            strict_share=(0.0, 1.0),
            penalty_start=(0.0, 1.0),
            penalty_until=(1, 1_000_000),
        )
        for name in ("strict", "command", "randomise"):
            if not 0 <= getattr(self, f"{name}_from") < getattr(self, f"{name}_until"):
                raise GaitshiftError(f"{name}_from must be 0 or more and below {name}_until")
        if self.iterations < 1:
            raise GaitshiftError(
                f"iterations of the stages must be 1 or more together, got {self.iterations}"
            )

    @property
    def iterations(self) -> int:
        """Iterations of all stages together."""
        return sum(stage.iterations for stage in self.stages)

    def with_iterations(self, iterations: int) -> "Recipe":
        """The same recipe with this number of iterations: cut, or with a longer last stage."""
        if iterations < 1:
            raise GaitshiftError(f"iterations must be 1 or more, got {iterations}")
        stages: list[Stage] = []
        left = iterations
        for index, stage in enumerate(self.stages, start=1):
            take = left if index == len(self.stages) else min(stage.iterations, left)
            stages.append(replace(stage, iterations=take))
            left -= take
        return replace(self, stages=tuple(s for s in stages if s.iterations > 0))

    def stage_at(self, iteration: int) -> tuple[Stage, int]:
        """The stage of an iteration and the iteration's number within it."""
        for stage in self.stages:
            if iteration < stage.iterations:
                return stage, iteration
            iteration -= stage.iterations
        return self.stages[-1], self.stages[-1].iterations + iteration

    def curriculum(self, iteration: int) -> Curriculum:
        """The curriculum at this iteration."""
        stage, _ = self.stage_at(iteration)
        strictness = _grown(iteration, self.strict_from, self.strict_until)
        first = self.penalty_start
        return Curriculum(
            strictness=self.strict_share * strictness,
            swing_factor=stage.swing_factor,
            stance_factor=stage.stance_factor,
            command_scale=_grown(iteration, self.command_from, self.command_until),
            penalty_scale=first + (1.0 - first) * _grown(iteration, 0, self.penalty_until),
            randomisation=_grown(iteration, self.randomise_from, self.randomise_until),
            mixed_starts=stage.mixed_starts,
        )

    def settling(self, iteration: int) -> float:
        """The factor on `desired_kl` and `entropy` at this iteration."""
        last = self.stages[-1]
        if last.settle == 0:
            return 1.0
        start = self.iterations - last.settle * last.iterations
        return 1.0 - 0.9 * _grown(iteration, start, self.iterations)

    def is_averaged(self, iteration: int) -> bool:
        """Whether the actor of a checkpoint at this iteration is averaged into the policy."""
        last = self.stages[-1]
        return last.averaged > 0 and iteration >= self.iterations - last.averaged * last.iterations


def _grown(iteration: int, start: float, end: float) -> float:
    """0 until `start`, 1 from `end` on, and a straight line in between."""
    return min(max((iteration - start) / (end - start), 0.0), 1.0)
