"""What a log says about a gait: its figures, its name, and whether it is clean."""

from gaitshift.gait_analysis.limits import FIRST_GAITS as FIRST_GAITS
from gaitshift.gait_analysis.limits import Limits as Limits
from gaitshift.gait_analysis.limits import limits_of as limits_of
from gaitshift.gait_analysis.measure import measure as measure
from gaitshift.gait_analysis.measure import robot_mass as robot_mass
from gaitshift.gait_analysis.naming import NONE as NONE
from gaitshift.gait_analysis.naming import gait_scores as gait_scores
from gaitshift.gait_analysis.naming import name_gait as name_gait
from gaitshift.gait_analysis.sample import WARM_UP as WARM_UP
from gaitshift.gait_analysis.sample import Sample as Sample
from gaitshift.gait_analysis.verdict import Check as Check
from gaitshift.gait_analysis.verdict import checks as checks
