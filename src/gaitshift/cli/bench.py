"""`gaitshift bench`: speed of the environment, and training time until a gait."""

from contextlib import nullcontext
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import tyro

from gaitshift import table
from gaitshift.cli.output import check_table_folder, emit_json, emit_table, progress, say
from gaitshift.control import policy
from gaitshift.data import located
from gaitshift.errors import GaitshiftError
from gaitshift.folder_lock import only_writer
from gaitshift.lab.benchmark.outcome import (
    COLUMNS,
    Outcome,
    outcome_of,
    ratio_text,
    row_of,
    summary,
)
from gaitshift.lab.benchmark.speed import (
    ALPHAS,
    BETAS,
    EPISODES,
    SpeedConfig,
    environment_speed,
    growth,
    replay_speed,
    training_speed,
)
from gaitshift.lab.benchmark.step import step_times

if TYPE_CHECKING:
    from gaitshift.lab.benchmark.time_to_gait import TimeToGait

TABLE, PICTURE = "time_to_gait.csv", "time_to_gait.png"


@dataclass(frozen=True, kw_only=True)
class TimeToGaitOptions:
    """For `bench time-to-gait`."""

    gaits: tuple[str, ...] | None = None
    """Gaits to train; by default trot, pace and bound, with --quick trot."""
    seeds: int | None = None
    """Number of seeds for each gait; by default 3, with --quick 1."""
    first_seed: int | None = None
    """First seed; 0 by default."""
    baseline_budget: float | None = None
    """Longest training time of the baseline [s]; by default 600, with --quick 1; 0: no baseline."""
    preset: Literal["default", "three-stage"] | None = None
    """Recipe whose flat stage trains; default if not given."""
    quick: bool = False
    """Train trot for seconds on few robots: a test run, not a measurement."""
    out: Path | None = None
    """Folder for time_to_gait.csv and time_to_gait.png. Trainings that the table already has are
    not repeated, so an interrupted command resumes. Trainings of another recipe stay in the table
    and are measured again."""
    overwrite: bool = False
    """Discard earlier results in the folder."""

    def config(self) -> "TimeToGait":
        """The configuration of the measurement."""
        from gaitshift.lab.benchmark.time_to_gait import TimeToGait, flat_stage

        given: dict[str, Any] = {
            name: getattr(self, name)
            for name in ("gaits", "seeds", "first_seed", "baseline_budget")
            if getattr(self, name) is not None
        }
        if self.preset is not None:
            if self.quick:
                raise GaitshiftError("--quick trains on a recipe of its own: no --preset")
            given["recipe"] = flat_stage(self.preset)
        return replace(TimeToGait.quick() if self.quick else TimeToGait(), **given)


@dataclass(frozen=True, kw_only=True)
class Bench:
    """Measure speed.

    speed: steps per second of the environment, of bare physics in the same run, and of training.

    time-to-gait: training until trot, pace and bound first pass a check on flat ground, with
    survival ≥ 0.99, speed within 0.1 m/s and pattern fraction ≥ 0.6, compared with PPO of
    stable-baselines3 at its defaults with 30 robots. Takes hours, most of them for the baseline.

    growth: the same for 32 to 4096 robots, and for one thread to one a core.

    peers: steps per second beside the same robot in Gymnasium's AsyncVectorEnv, in
    stable-baselines3's SubprocVecEnv and in mujoco.rollout, in turns.

    page: whether the page of `gaitshift view` runs in real time on one core at 50 frames per
    second.

    step: how long a control step of `gaitshift deploy` takes for one robot, and its parts.

    replay: how long `identify` takes for 1000 episodes of 20 s, 100 α and 1000 β.
    """

    what: Annotated[
        Literal["speed", "growth", "peers", "time-to-gait", "page", "step", "replay"],
        tyro.conf.Positional,
    ] = "speed"
    """What to measure."""
    speed: SpeedConfig = field(default_factory=SpeedConfig)
    """For `bench speed`, `growth` and `peers`."""
    time_to_gait: TimeToGaitOptions = field(default_factory=TimeToGaitOptions)
    """For `bench time-to-gait`."""
    page_seconds: float = 20.0
    """For `bench page`: duration of each run [s]."""
    json: bool = False
    """One JSON object on stdout."""

    def run(self) -> None:
        """Measures and prints."""
        if self.what == "speed":
            self._measure_speed()
        elif self.what == "growth":
            self._measure_growth()
        elif self.what == "peers":
            self._measure_peers()
        elif self.what == "page":
            self._measure_page()
        elif self.what == "step":
            self._measure_step()
        elif self.what == "replay":
            self._measure_replay()
        else:
            self._measure_time_to_gait()

    def _measure_speed(self) -> None:
        with progress("measuring") as report:
            figures = environment_speed(self.speed, report)
            try:
                figures |= training_speed(self.speed.seed)
            except ImportError as error:
                say(f"training is not measured: the package '{error.name}' is missing")
        rows = [
            (name, f"{value:,.2f}" if value < 10 else f"{value:,.0f}")
            for name, value in figures.items()
        ]
        self._emit(figures, f"bench: {self.speed.robots} robots on {self.speed.terrain}", rows)

    def _emit(self, figures: object, title: str, rows: list[tuple[str, ...]]) -> None:
        emit_json(figures) if self.json else emit_table(title, rows)

    def _measure_growth(self) -> None:
        with progress("measuring") as report:
            found = growth(self.speed, report)
        rows = [
            (
                name,
                f"{figures['env_steps_per_s']:,.0f} steps/s",
                f"{figures['env_over_bare']:.2f} of bare physics",
            )
            for name, figures in found.items()
        ]
        self._emit(found, f"bench: growth on {self.speed.terrain}", rows)

    def _measure_peers(self) -> None:
        from gaitshift.lab.benchmark.peers import OURS, peer_speeds  # starts processes

        with progress("measuring") as report:
            found = peer_speeds(self.speed, report)
        rows = [
            (name, f"{rate:,.0f} steps/s", f"{found[OURS] / rate:.2f}")
            for name, rate in found.items()
        ]
        self._emit(
            found,
            f"bench: {self.speed.robots} robots on {self.speed.terrain}, gaitshift over each",
            rows,
        )

    def _measure_page(self) -> None:
        try:
            from gaitshift.show.viewer.timing import ROBOTS, page_speed
        except ImportError as error:
            raise GaitshiftError(
                f"the page needs the package '{error.name}'; install gaitshift[view]"
            ) from error
        policies = {name: policy.load(name) for name in policy.shipped()}
        found: dict[int, dict[str, float]] = {}
        with progress("watching") as report:
            for robots in ROBOTS:
                found[robots] = page_speed(robots, self.page_seconds, policies)
                report(len(found), len(ROBOTS))
        rows: list[tuple[str, ...]] = [
            (f"{name}, robots: {robots}", f"{value:.2f}")
            for robots, of in found.items()
            for name, value in of.items()
        ]
        figures = {f"robots_{robots}": of for robots, of in found.items()}
        self._emit(figures, "bench: the live page on one core", rows)

    def _measure_step(self) -> None:
        with progress("walking") as report:
            found = step_times(seed=self.speed.seed)
            report(1, 1)
        rows = [(name.replace("_", " "), f"{value:.3f} ms") for name, value in found.items()]
        self._emit(found, "bench: a control step of one robot, medians", rows)

    def _measure_replay(self) -> None:
        try:
            seconds = replay_speed(self.speed.seed)
        except ImportError as error:
            raise GaitshiftError(
                f"the replay needs the package '{error.name}'; install gaitshift[identify]"
            ) from error
        what = f"{EPISODES} episodes, {len(ALPHAS)} α, {len(BETAS)} β"
        self._emit(
            seconds,
            "bench: replay",
            [(f"{what}, {name}", f"{x:.1f}") for name, x in seconds.items()],
        )

    def _measure_time_to_gait(self) -> None:
        from gaitshift.lab.benchmark.time_to_gait import is_of, time_to_gait

        options = self.time_to_gait
        config, out = options.config(), options.out
        known: list[Outcome] = []
        outcomes: list[Outcome] = []
        with nullcontext() if out is None else only_writer(out), progress("training") as report:
            if out is not None:
                known = self._known(out / TABLE)
            for outcome in time_to_gait(config, known):
                outcomes.append(outcome)
                report(len(outcomes), config.trainings)
                say(f"{outcome.gait}, seed {outcome.seed}, {outcome.learner}: {_text(outcome)}")
                if out is not None:
                    rows = [*outcomes, *(one for one in known if not _is_repeated(one, outcomes))]
                    table.write(out / TABLE, [row_of(one) for one in rows], COLUMNS)
                    _draw([one for one in rows if is_of(config, one)], out)
        found = summary(outcomes)
        self._emit(
            {"check": asdict(config.check), "gaits": found},
            "time to gait, median over seeds (all seeds)",
            _rows(found),
        )

    def _known(self, path: Path) -> list[Outcome]:
        """The outcomes in an earlier table."""
        overwrite = self.time_to_gait.overwrite
        check_table_folder(path, overwrite=overwrite)
        rows = [] if overwrite else table.read_typed(path, COLUMNS, "trainings")
        with located(str(path)):
            return [outcome_of(row) for row in rows]


def _draw(outcomes: list[Outcome], out: Path) -> None:
    from gaitshift.show.plots import time_to_gait_figure  # matplotlib is slow to import

    time_to_gait_figure(outcomes, out / PICTURE)


def _is_repeated(known: Outcome, outcomes: list[Outcome]) -> bool:
    """Whether the new outcomes have one of the same training."""
    return any(
        (known.gait, known.learner, known.seed, known.recipe)
        == (one.gait, one.learner, one.seed, one.recipe)
        for one in outcomes
    )


def _text(outcome: Outcome) -> str:
    bound = "" if outcome.reached else "> "
    speed = "–" if outcome.speed is None else f"{outcome.speed:.2f}"
    pattern = "–" if outcome.pattern_fraction is None else f"{outcome.pattern_fraction:.2f}"
    return (
        f"{bound}{outcome.seconds:.0f} s, {bound}{outcome.steps / 1e6:.2f} M steps "
        f"(survival {outcome.survival:.2f}, {speed} m/s, pattern {pattern})"
    )


def _rows(found: dict[str, Any]) -> list[tuple[str, ...]]:
    rows: list[tuple[str, ...]] = []
    for gait, entry in found.items():
        for learner, median in entry["learners"].items():
            bound = "" if median["reached"] else "> "
            seeds = ", ".join(_seconds(one["reached"], one["seconds"]) for one in median["seeds"])
            steps = f"{bound}{median['steps'] / 1e6:.2f} M steps"
            seconds = _seconds(median["reached"], median["seconds"])
            rows.append((f"{gait}, {learner}", f"{seconds}, {steps} ({seeds})"))
        if entry["ratio"] is not None:
            times = ratio_text(entry["ratio"], is_lower_bound=entry["ratio_is_lower_bound"])
            rows.append((f"{gait}, ratio", times))
    return rows


def _seconds(reached: bool, seconds: float) -> str:
    return f"{seconds:.0f} s" if reached else f"> {seconds:.0f} s"
