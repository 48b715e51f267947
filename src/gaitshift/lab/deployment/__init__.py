"""Deployment recorded: the log of a simulated robot in real time, and its controller's table."""

from gaitshift.lab.deployment.robot_run import RobotRecorder as RobotRecorder
from gaitshift.lab.deployment.robot_run import run_robot as run_robot
from gaitshift.lab.deployment.sensed_table import SensedTable as SensedTable
