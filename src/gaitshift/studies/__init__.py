"""Evidence on shifting: many robots, told with intervals."""

from gaitshift.studies.transitions import GROUNDS as GROUNDS
from gaitshift.studies.transitions import Outcomes as Outcomes
from gaitshift.studies.transitions import Pair as Pair
from gaitshift.studies.transitions import run_pair as run_pair
