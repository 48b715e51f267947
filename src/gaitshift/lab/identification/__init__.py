"""Which condition, and with which numbers: recordings replayed over whole grids of α and β."""

from gaitshift.lab.identification.choice import Choice as Choice
from gaitshift.lab.identification.choice import choose as choose
from gaitshift.lab.identification.grid import counters as counters
from gaitshift.lab.identification.grid import counts_at as counts_at
from gaitshift.lab.identification.grid import first_firings as first_firings
from gaitshift.lab.identification.labels import is_rough as is_rough
from gaitshift.lab.identification.labels import rough_ground as rough_ground
from gaitshift.lab.identification.log_files import passages as passages
from gaitshift.lab.identification.recording import Recording as Recording
from gaitshift.lab.identification.scores import Detections as Detections
from gaitshift.lab.identification.scores import FalseShifts as FalseShifts
from gaitshift.lab.identification.scores import detections as detections
from gaitshift.lab.identification.scores import false_shifts as false_shifts
from gaitshift.lab.identification.statistics import auc as auc
from gaitshift.lab.identification.statistics import poisson as poisson
from gaitshift.lab.identification.statistics import wilson as wilson
from gaitshift.lab.identification.tally import Grid as Grid
from gaitshift.lab.identification.tally import Tally as Tally
from gaitshift.lab.identification.tally import replay as replay
