"""The robot: its legs, description, state and commands."""

from gaitshift.robot.command import Command as Command
from gaitshift.robot.command import HeadingLoop as HeadingLoop
from gaitshift.robot.command import SpeedLoop as SpeedLoop
from gaitshift.robot.description import ANYMAL_B as ANYMAL_B
from gaitshift.robot.description import Gains as Gains
from gaitshift.robot.description import Robot as Robot
from gaitshift.robot.legs import JOINTS as JOINTS
from gaitshift.robot.legs import LEGS as LEGS
from gaitshift.robot.state import Privileged as Privileged
from gaitshift.robot.state import Proprioception as Proprioception
