"""Runs trained robots many at a time: rollouts, evaluations, the demonstration."""

from gaitshift.evaluation.commands import Followed as Followed
from gaitshift.evaluation.commands import follow_commands as follow_commands
from gaitshift.evaluation.demo import DemoConfig as DemoConfig
from gaitshift.evaluation.demo import run_demo as run_demo
from gaitshift.evaluation.demo import summarise as summarise
from gaitshift.evaluation.evaluate import EvaluationConfig as EvaluationConfig
from gaitshift.evaluation.evaluate import evaluate as evaluate
from gaitshift.evaluation.evaluate import evaluate_controller as evaluate_controller
from gaitshift.evaluation.glance import glance as glance
from gaitshift.evaluation.rollout import RolloutConfig as RolloutConfig
from gaitshift.evaluation.rollout import rollout as rollout
from gaitshift.evaluation.trials import SIZES as SIZES
from gaitshift.evaluation.trials import run_trials as run_trials
