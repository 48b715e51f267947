"""Which condition, and with which numbers: recordings replayed over whole grids of α and β."""

from gaitshift.lab.identification.choice import Choice as Choice
from gaitshift.lab.identification.choice import choose as choose
from gaitshift.lab.identification.firings import Detections as Detections
from gaitshift.lab.identification.firings import FalseShifts as FalseShifts
from gaitshift.lab.identification.firings import ParameterGrid as ParameterGrid
from gaitshift.lab.identification.firings import Tally as Tally
from gaitshift.lab.identification.firings import counters as counters
from gaitshift.lab.identification.firings import counts_at as counts_at
from gaitshift.lab.identification.firings import detections as detections
from gaitshift.lab.identification.firings import false_shifts as false_shifts
from gaitshift.lab.identification.firings import first_firings as first_firings
from gaitshift.lab.identification.labelled_run import LabelledRun as LabelledRun
from gaitshift.lab.identification.labelled_run import is_rough as is_rough
from gaitshift.lab.identification.labelled_run import rough_ground as rough_ground
from gaitshift.lab.identification.log_files import passages as passages
from gaitshift.lab.identification.statistics import auc as auc
from gaitshift.lab.identification.statistics import poisson as poisson
from gaitshift.lab.identification.statistics import wilson as wilson
