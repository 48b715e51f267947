"""A controller without learning: coupled oscillators, foot paths and inverse kinematics.

It has the same `act` and `see` as trained policies, and shifts by the same conditions.
"""

from gaitshift.control.cpg.controller import CpgController as CpgController
from gaitshift.control.cpg.kinematics import joint_angles as joint_angles
from gaitshift.control.cpg.oscillators import GAITS as GAITS
from gaitshift.control.cpg.oscillators import CpgGait as CpgGait
from gaitshift.control.cpg.oscillators import HopfNetwork as HopfNetwork
