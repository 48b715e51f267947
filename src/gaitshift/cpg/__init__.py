"""A controller that learned nothing: coupled oscillators, foot paths and inverse kinematics.

It walks by the same `act` and `see` as trained policies, and shifts by the same conditions.
"""

from gaitshift.cpg.controller import CpgController as CpgController
from gaitshift.cpg.gait import GAITS as GAITS
from gaitshift.cpg.gait import CpgGait as CpgGait
from gaitshift.cpg.kinematics import joint_angles as joint_angles
from gaitshift.cpg.oscillators import HopfNetwork as HopfNetwork
