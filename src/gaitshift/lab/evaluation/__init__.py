"""Runs trained robots many at a time: rollouts, evaluations, the demonstration."""

from gaitshift.lab.evaluation.commands import Followed as Followed
from gaitshift.lab.evaluation.commands import follow_commands as follow_commands
from gaitshift.lab.evaluation.demo import DemoConfig as DemoConfig
from gaitshift.lab.evaluation.demo import run_demo as run_demo
from gaitshift.lab.evaluation.demo import summarise as summarise
from gaitshift.lab.evaluation.evaluate import EvaluationConfig as EvaluationConfig
from gaitshift.lab.evaluation.evaluate import evaluate as evaluate
from gaitshift.lab.evaluation.evaluate import evaluate_controller as evaluate_controller
from gaitshift.lab.evaluation.evaluate import flat_verdict as flat_verdict
from gaitshift.lab.evaluation.rollout import RolloutConfig as RolloutConfig
from gaitshift.lab.evaluation.rollout import rollout as rollout
from gaitshift.lab.evaluation.trials import SIZES as SIZES
from gaitshift.lab.evaluation.trials import run_trials as run_trials
