"""What a log says about a gait: its figures, its name, and whether it is clean."""

from gaitshift.lab.gait_analysis.measure import measure as measure
from gaitshift.lab.gait_analysis.naming import NONE as NONE
from gaitshift.lab.gait_analysis.naming import gait_scores as gait_scores
from gaitshift.lab.gait_analysis.naming import name_gait as name_gait
from gaitshift.lab.gait_analysis.sample import WARM_UP as WARM_UP
from gaitshift.lab.gait_analysis.sample import Sample as Sample
from gaitshift.lab.gait_analysis.verdict import FIRST_GAITS as FIRST_GAITS
from gaitshift.lab.gait_analysis.verdict import Check as Check
from gaitshift.lab.gait_analysis.verdict import Limits as Limits
from gaitshift.lab.gait_analysis.verdict import checks as checks
from gaitshift.lab.gait_analysis.verdict import limits_of as limits_of
