"""Which condition, and with which numbers: recordings replayed over whole grids of α and β."""

from gaitshift.identification.choice import Choice as Choice
from gaitshift.identification.choice import choose as choose
from gaitshift.identification.grid import counters as counters
from gaitshift.identification.grid import counts_at as counts_at
from gaitshift.identification.grid import first_firings as first_firings
from gaitshift.identification.labels import is_rough as is_rough
from gaitshift.identification.labels import rough_ground as rough_ground
from gaitshift.identification.recording import Recording as Recording
from gaitshift.identification.scores import Detections as Detections
from gaitshift.identification.scores import FalseShifts as FalseShifts
from gaitshift.identification.scores import detections as detections
from gaitshift.identification.scores import false_shifts as false_shifts
from gaitshift.identification.statistics import auc as auc
from gaitshift.identification.statistics import poisson as poisson
from gaitshift.identification.statistics import wilson as wilson
from gaitshift.identification.table import passages as passages
from gaitshift.identification.tally import Grid as Grid
from gaitshift.identification.tally import Tally as Tally
from gaitshift.identification.tally import replay as replay
