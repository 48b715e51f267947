"""Controllers of robots: policies and oscillators, and switchers that change their gaits."""

from gaitshift.control.controller import CONTROLLERS as CONTROLLERS
from gaitshift.control.controller import Controller as Controller
from gaitshift.control.controller import Repertoire as Repertoire
from gaitshift.control.driver import Driver as Driver
from gaitshift.control.estimator import Estimation as Estimation
from gaitshift.control.estimator import Estimator as Estimator
from gaitshift.control.estimator import EstimatorConfig as EstimatorConfig
from gaitshift.control.estimator import EstimatorState as EstimatorState
from gaitshift.control.policy import Policy as Policy
from gaitshift.control.switcher import Autonomous as Autonomous
from gaitshift.control.switcher import Scheduled as Scheduled
from gaitshift.control.switcher import Switcher as Switcher
from gaitshift.control.walker import Walker as Walker
