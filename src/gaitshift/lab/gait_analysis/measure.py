"""All figures of a log at once: what `gaitshift evaluate` prints."""

from collections.abc import Mapping
from typing import Any

from gaitshift.gait import RewardMachine
from gaitshift.lab.gait_analysis.base import base_figures, lateral_error
from gaitshift.lab.gait_analysis.feet import feet_figures
from gaitshift.lab.gait_analysis.naming import gait_scores, name_gait
from gaitshift.lab.gait_analysis.sample import WARM_UP, Sample
from gaitshift.lab.gait_analysis.verdict import checks
from gaitshift.lab.log import Log
from gaitshift.robot.description import Robot


def measure(
    log: Log, machines: Mapping[str, RewardMachine], robot: Robot, *, warm_up: float = WARM_UP
) -> dict[str, Any]:
    """Figures of a log, over all robots while they are on their feet, after the warm-up.

    Robots are pooled. A figure is None where there was nothing to measure.

    - `survival`: share of robots that never fell, warm-up included.
    - `speed_mean` [m/s]: mean velocity along body x; `speed_error` [m/s]: its distance from the
      mean command; `speed_rmse` [m/s]: root mean square of the difference at each step.
    - `heading_drift` [rad/s]: root mean square over robots of the net turn less the commanded turn,
      over its time; `heading_error_sd` [rad]: spread of the heading about the line x.
    - `cost_of_transport`: mean mechanical power Σ|τ q̇| over m·g·v.
    - `froude`: v²/(g h), v the mean speed, h the median height of the base over the lowest foot.
    - `roll_rate_sd`, `pitch_rate_sd` [rad/s]: spread of the body's angular velocity about x and y.
    - `overspeed`: share of steps in which a joint is faster than the robot's limit.
    - `slip` [m/s]: mean horizontal speed of the feet in contact.
    - `pattern_fraction`: share of steps whose contacts are a stance set of the gait's machine.
    - `cycles_per_s` [Hz]: full cycles of the machine, counted by entries into its first state.
    - `touchdowns_per_cycle` (4,): raw contact onsets of each foot over those of the machine, in
      whole cycles: 1 where no foot bounces, also for a gait with two touchdowns per cycle.
    - `phase` (4,) [stride of FL], `phase_consistency` (4,): circular mean and resultant length of
      touchdowns within the strides of FL (`phase.Phases`), 0 and 1 for FL itself.
    - `duty_factor` (4,): share of the time of whole cycles that each foot is down.
    - `clearance` (4,) [m]: median over strides of the greatest height of the sole over the ground.
    - `flight_fraction`: share of steps with no foot down.
    - `lateral_error_p95` [m]: 95th percentile of the distance from the line, at the end.
    - `verdict`: `gait`, the name by the contacts alone, or "none"; `scores` of every known gait;
      `clean`, whether the name is that of the active gait and all its limits are met; `misses`,
      the limits that are not met.

    Args:
        log: the run; where it has several gaits, phases and verdict are those of the one that was
            active for most of the time.
        machines: the machines of the gaits in it, by name.
        robot: the robot of the log, for its mass and its joint speed limit.
        warm_up: seconds left out.
    """
    sample = Sample.of(log, warm_up)
    figures: dict[str, Any] = {
        "survival": float(1.0 - log.fallen[-1].mean()),
        **base_figures(sample, robot),
        **feet_figures(sample, machines),
        "lateral_error_p95": lateral_error(log),
    }
    gait = sample.gait()
    scores = gait_scores(sample, machines.values())
    misses = [check.to_dict() for check in checks(figures, machines[gait]) if not check.passed]
    name = name_gait(scores)
    figures["verdict"] = {
        "gait": name,
        "clean": name == gait and not misses,
        "scores": scores,
        "misses": misses,
    }
    return figures
