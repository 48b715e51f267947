"""Deployment: the control loop of a robot that is reached by datagrams; no simulator is needed."""

from gaitshift.control.deployment.config import DeploymentConfig as DeploymentConfig
from gaitshift.control.deployment.link import Link as Link
from gaitshift.control.deployment.link import UdpLink as UdpLink
from gaitshift.control.deployment.loop import ControlStep as ControlStep
from gaitshift.control.deployment.loop import Deployment as Deployment
from gaitshift.control.deployment.real_time import run as run
from gaitshift.control.deployment.timing import Timing as Timing
