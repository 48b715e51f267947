"""The conditions by which a robot shifts its gait itself: numpy alone, fit to run on the robot."""

from gaitshift.switching.driver import Driver as Driver
from gaitshift.switching.height_difference import HeightDifference as HeightDifference
from gaitshift.switching.height_difference import HeightState as HeightState
from gaitshift.switching.height_difference import height_in_frame as height_in_frame
from gaitshift.switching.switcher import Autonomous as Autonomous
from gaitshift.switching.switcher import Decision as Decision
from gaitshift.switching.switcher import Scheduled as Scheduled
from gaitshift.switching.switcher import Switcher as Switcher
