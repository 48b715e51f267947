"""`gaitshift evaluate`: judges a policy on many robots at once."""

from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Annotated

import tyro

from gaitshift import policy as policies
from gaitshift.cli.output import emit_json, emit_table, progress, say
from gaitshift.errors import GaitshiftError
from gaitshift.evaluation import EvaluationConfig, evaluate

UNITS = {
    "speed_mean": "m/s",
    "speed_rmse": "m/s",
    "cycles_per_s": "Hz",
    "slip": "m/s",
    "heading_error_sd": "rad",
    "lateral_error_p95": "m",
}
"""Units of the figures that have one."""


@dataclass(frozen=True, kw_only=True)
class Evaluate(EvaluationConfig):
    """Judge a policy: many robots at once, without exploration noise.

    Figures leave out the first 2 s and robots after their fall.
    """

    policy: Annotated[str, tyro.conf.Positional]
    """A shipped policy by the name of its gait, or a policy file ending in .onnx."""
    json: bool = False
    """One JSON object on stdout."""
    log: Path | None = None
    """Write the whole run as an npz log to this file."""
    overwrite: bool = False
    """Replace the log file if it exists."""

    def run(self) -> None:
        """Evaluates and prints."""
        if self.log is not None and self.log.exists() and not self.overwrite:
            raise GaitshiftError(f"{self.log} exists; give another --log, or --overwrite")
        loaded = policies.load(self.policy)
        config = EvaluationConfig(
            **{name: getattr(self, name) for name in EvaluationConfig.__dataclass_fields__}
        )
        with progress(f"{loaded.gait} on {self.terrain}") as report:
            figures, log = evaluate(loaded, config, report)
        if self.log is not None:
            self.log.parent.mkdir(parents=True, exist_ok=True)
            log.save(self.log)
            say(f"log written to {self.log}")
        if self.json:
            emit_json(
                {"policy": str(loaded.path), "gait": loaded.gait, **asdict(config), **figures}
            )
            return
        rows = [(name, _text(value, UNITS.get(name, ""))) for name, value in figures.items()]
        title = f"{loaded.gait} on {self.terrain}, {self.episodes} robots × {self.seconds:g} s"
        emit_table(title, rows)


def _text(value: float | list[float], unit: str) -> str:
    if isinstance(value, list):
        return " ".join(f"{x:.3f}" for x in value)
    return f"{value:.4g} {unit}".strip()
