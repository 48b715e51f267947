"""Studies of gait shifts: many robots, results with confidence intervals."""

from gaitshift.lab.studies.transitions import GROUNDS as GROUNDS
from gaitshift.lab.studies.transitions import Outcomes as Outcomes
from gaitshift.lab.studies.transitions import Pair as Pair
from gaitshift.lab.studies.transitions import run_pair as run_pair
