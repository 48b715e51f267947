"""`gaitshift evaluate`: judges a policy on many robots at once."""

from collections.abc import Callable
from dataclasses import asdict, dataclass, fields
from functools import partial
from pathlib import Path
from typing import Annotated, Any, Literal

import tyro

from gaitshift.cli.output import Report, emit_json, emit_table, progress, say
from gaitshift.cli.robot_options import RobotOption, SensorOption
from gaitshift.control import policy as policies
from gaitshift.control.controller import controller_maker
from gaitshift.errors import GaitshiftError
from gaitshift.gait import RewardMachine
from gaitshift.lab.evaluation import (
    SIZES,
    EvaluationConfig,
    Followed,
    evaluate,
    evaluate_controller,
    follow_commands,
    run_trials,
)
from gaitshift.lab.evaluation.trials import Row
from gaitshift.lab.log import Log
from gaitshift.sim.terrain import spec_help

Judged = tuple[dict[str, Any], Log]
"""Figures and their log."""

UNITS = {
    "speed_mean": "m/s",
    "speed_error": "m/s",
    "speed_rmse": "m/s",
    "heading_drift": "rad/s",
    "heading_error_sd": "rad",
    "roll_rate_sd": "rad/s",
    "pitch_rate_sd": "rad/s",
    "cycles_per_s": "Hz",
    "lateral_speed_mean": "m/s",
    "yaw_rate_mean": "rad/s",
    "height_mean": "m",
    "drift": "m",
    "slip": "m/s",
    "clearance": "m",
    "lateral_error_p95": "m",
}
"""Units of the figures that have units."""


@dataclass(frozen=True, kw_only=True)
class Evaluate(RobotOption, SensorOption, EvaluationConfig):
    """Evaluate a policy on many robots, without exploration noise.

    Figures exclude the first 2 s and robots after their fall.
    """

    terrain: Annotated[str, tyro.conf.arg(help=f"Spec of the ground:\n{spec_help()}\n")] = (
        EvaluationConfig.terrain
    )
    policy: Annotated[str, tyro.conf.Positional]
    """A shipped policy by the name of its gait, or a policy file ending in .onnx."""
    controller: str = "policy"
    """What walks, by name: `policy`; or, in the gait of this name, `cpg`, coupled oscillators
    without learning, a baseline (trot, pace, bound, walk)."""
    trials: Literal["all", "short", "quick"] | None = None
    """Run the standard trials and compare each figure with its limit: all (1000 pushed episodes,
    then 256 of 20 s on each terrain), short (a quarter of each), or quick (for a first check)."""
    commands: bool = False
    """Track commanded speeds and stride frequencies over their ranges on flat ground, in place of
    the evaluation."""
    json: bool = False
    """One JSON object on stdout."""
    log: Path | None = None
    """Write the log of the run to this npz file; with --trials, the log of the flat trial."""
    plot: Path | None = None
    """Draw the gait diagram and the phase circle into this .png, .svg or .pdf file."""
    overwrite: bool = False
    """Replace files that exist."""

    def run(self) -> None:
        """Evaluates, prints and draws."""
        self._check_files()
        if self.controller != "policy":
            make, robot = controller_maker(self.controller), self.read_robot()
            walker = make([self.policy], self.episodes, robot=robot)
            self._make_folder()
            named = {"controller": self.controller, "gait": walker.repertoire.gaits[0]}
            figures, log = self._evaluate(partial(evaluate_controller, walker), named)
            self._write(figures, log, walker.repertoire.machines[0])
            return
        loaded = policies.load(self.policy, self.read_robot())
        self._make_folder()
        if self.commands:
            self._command(loaded)
            return
        if self.trials is None:
            named = {"policy": str(loaded.path), "gait": loaded.gait}
            figures, log = self._evaluate(partial(evaluate, loaded), named)
        else:
            figures, log = self._try(loaded, self.trials)
        self._write(figures, log, loaded.machine)

    def _make_folder(self) -> None:
        """Creates the folder of the log, so that an error comes before the run."""
        if self.log is not None:
            self.log.parent.mkdir(parents=True, exist_ok=True)

    def _write(self, figures: dict[str, Any], log: Log, machine: RewardMachine) -> None:
        """Writes the log and the figure, where given."""
        if self.log is not None:
            log.save(self.log)
            say(f"log written to {self.log}")
        if self.plot is not None:
            from gaitshift.show.plots import hildebrand_diagram  # matplotlib is slow to import

            hildebrand_diagram(log, figures, machine, self.plot)
            say(f"diagram written to {self.plot}")

    def _evaluate(
        self, walk: Callable[[EvaluationConfig, Report], Judged], named: dict[str, str]
    ) -> Judged:
        config, gait = self._config(), named["gait"]
        with progress(f"{gait} on {self.terrain}") as report:
            figures, log = walk(config, report)
        if self.json:
            emit_json({**named, **asdict(config), "sensors": config.sensors.name, **figures})
        else:
            title = f"{gait} on {self.terrain}, {self.episodes} robots × {self.seconds:g} s"
            emit_table(title, _figure_rows(figures))
        return figures, log

    def _try(self, loaded: policies.Policy, size: Literal["all", "short", "quick"]) -> Judged:
        with progress(f"trials of {loaded.gait}") as report:
            rows, figures, log = run_trials(
                loaded,
                SIZES[size],
                self.seed,
                report,
                sensors=self.sensors,
                simulator=self.simulator,
            )
        if self.json:
            emit_json(
                {
                    "policy": str(loaded.path),
                    "gait": loaded.gait,
                    "size": {"name": size, **asdict(SIZES[size])},
                    "sensors": self.sensors.name,
                    "seed": self.seed,
                    "simulator": self.simulator,
                    "trials": [row.to_dict() for row in rows],
                    "figures": figures,
                }
            )
        else:
            failed = sum(row.passed is False for row in rows)
            limited = sum(row.passed is not None for row in rows)
            title = f"{loaded.gait}, {size} trials: {limited - failed} of {limited} limits met"
            emit_table(title, [_trial_row(row) for row in rows])
        return figures, log

    def _command(self, loaded: policies.Policy) -> None:
        with progress(f"commands of {loaded.gait}") as report:
            rows = follow_commands(loaded, self.seed, report, sensors=self.sensors)
        if self.json:
            followed = [asdict(row) for row in rows]
            emit_json(
                {
                    "policy": str(loaded.path),
                    "gait": loaded.gait,
                    "sensors": self.sensors.name,
                    "commands": followed,
                }
            )
        else:
            emit_table(f"{loaded.gait}, tracking of commands on flat ground", _followed(rows))

    def _config(self) -> EvaluationConfig:
        names = EvaluationConfig.__dataclass_fields__
        return EvaluationConfig(**{name: getattr(self, name) for name in names})

    def _check_files(self) -> None:
        """Raises `GaitshiftError` for bad paths before any work."""
        for option, path in (("--log", self.log), ("--plot", self.plot)):
            if path is not None and path.is_dir():
                raise GaitshiftError(f"{option} must be a file, got the folder {path}")
            if path is not None and path.exists() and not self.overwrite:
                raise GaitshiftError(f"{path} exists; give another {option}, or --overwrite")
        if self.plot is not None:
            from gaitshift.show.plots.style import check_target

            check_target(self.plot)
        if self.trials is None and not self.commands:
            return
        mode = "--commands" if self.commands else "--trials"
        if self.controller != "policy":
            raise GaitshiftError(f"{mode} is for policies, got --controller {self.controller}")
        if self.commands and (self.trials or self.log or self.plot):
            raise GaitshiftError("--commands must not be given with --trials, --log or --plot")
        for field in fields(EvaluationConfig):
            is_free = field.name in ("sensors", "seed") or (
                self.trials and field.name == "simulator"
            )
            if not is_free and getattr(self, field.name) != field.default:
                option = field.name.replace("_", "-")
                raise GaitshiftError(f"--{option} must not be given with {mode}, which sets it")


def _figure_rows(figures: dict[str, Any]) -> list[tuple[str, str]]:
    plain = {name: value for name, value in figures.items() if name != "verdict"}
    rows = [(name, _text(value, UNITS.get(name, ""))) for name, value in plain.items()]
    verdict = figures["verdict"]
    score = max(verdict["scores"].values())
    rows.append(("verdict", f"{verdict['gait']}, score {score:.2f}"))
    rows.append(("clean", "yes" if verdict["clean"] else "no"))
    for miss in verdict["misses"]:
        side = "at_least" if "at_least" in miss else "at_most"
        foot = f", {miss['foot']}" if "foot" in miss else ""
        limit = f"{side.replace('_', ' ')} {miss[side]:g}"
        rows.append((f"  misses {miss['figure']}{foot}", f"{_text(miss['value'], '')}, {limit}"))
    return rows


def _followed(rows: list[Followed]) -> list[tuple[str, ...]]:
    head = ("command", "speed", "cycles", "pattern", "survival")
    return [head] + [
        (
            f"{row.forward_speed:.2f} m/s, {row.stride_frequency:.2f} Hz",
            _text(row.speed_mean, "m/s"),
            _text(row.cycles_per_s, "Hz"),
            _text(row.pattern_fraction, ""),
            _text(row.survival, ""),
        )
        for row in rows
    ]


def _trial_row(row: Row) -> tuple[str, ...]:
    value = _text(row.value, "")
    if row.limit is None:
        return row.trial, value, "", "reported"
    limit = f"{row.bound.replace('_', ' ')} {row.limit:g}"
    return row.trial, value, limit, "pass" if row.passed else "FAIL"


def _text(value: float | list[float | None] | None, unit: str) -> str:
    if isinstance(value, list):
        numbers = " ".join("–" if x is None else f"{x:.3f}" for x in value)
        return f"{numbers} {unit}".strip()
    return "–" if value is None else f"{value:.4g} {unit}".strip()
