"""The conditions by which a robot shifts its gait itself: numpy alone, fit to run on the robot."""

from gaitshift.shift.condition import Condition as Condition
from gaitshift.shift.condition import ConditionState as ConditionState
from gaitshift.shift.graph import Edge as Edge
from gaitshift.shift.graph import GaitGraph as GaitGraph
from gaitshift.shift.modulation import Modulation as Modulation
from gaitshift.shift.named import CONDITIONS as CONDITIONS
from gaitshift.shift.named import STATISTICS as STATISTICS
from gaitshift.shift.named import load_condition as load_condition
from gaitshift.shift.rule import Rule as Rule
from gaitshift.shift.signals import Signals as Signals
from gaitshift.shift.statistic import AnyStatistic as AnyStatistic
from gaitshift.shift.statistic import Statistic as Statistic
from gaitshift.shift.statistics.attitude import AttitudeVariance as AttitudeVariance
from gaitshift.shift.statistics.energy import CostOfTransport as CostOfTransport
from gaitshift.shift.statistics.height_difference import HeightDifference as HeightDifference
from gaitshift.shift.statistics.height_difference import height_in_frame as height_in_frame
from gaitshift.shift.statistics.odometry import LegOdometry as LegOdometry
from gaitshift.shift.statistics.oracle import Oracle as Oracle
from gaitshift.shift.statistics.plane import PlaneResidual as PlaneResidual
from gaitshift.shift.statistics.slip import Slip as Slip
from gaitshift.shift.statistics.speed import SpeedCommand as SpeedCommand
from gaitshift.shift.statistics.surprise import TouchdownSurprise as TouchdownSurprise
from gaitshift.shift.statistics.timing import ContactTiming as ContactTiming
from gaitshift.shift.statistics.value_drop import ValueDrop as ValueDrop
