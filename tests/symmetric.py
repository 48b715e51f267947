"""A robot that is its own mirror image, for tests of left and right."""

import xml.etree.ElementTree as ET
from dataclasses import replace

from gaitshift.robot.description import ANYMAL_B


def symmetric_robot(folder):
    """ANYmal B without what sets its left apart from its right.

    The published inertial figures are not quite symmetric: the centre of mass of the base lies
    1.4 mm to the right, its inertia has products with y, and the inertial sensor sits on the left.
    """
    tree = ET.parse(ANYMAL_B.model_file)
    bodies = {body.get("name"): body for body in tree.iter("body")}
    for name, body in bodies.items():
        if name == "base" or name.endswith("_adapter"):
            inertial = body.find("inertial")
            x, _, z = inertial.get("pos").split()
            xx, yy, zz, _, xz, _ = inertial.get("fullinertia").split()
            inertial.set("pos", f"{x} 0 {z}")
            inertial.set("fullinertia", f"{xx} {yy} {zz} 0 {xz} 0")
    x, _, z = bodies["imu_link"].get("pos").split()
    bodies["imu_link"].set("pos", f"{x} 0 {z}")
    file = folder / "symmetric.xml"
    tree.write(file)
    return replace(ANYMAL_B, model_file=file)
