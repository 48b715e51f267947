"""The loop on a robot: sensors in, joint targets out, gaits changed by the robot itself, at 100 Hz.

Nothing here needs a simulator: NumPy and onnxruntime are enough. `read_sensors` stands for your
robot; it gives plain arrays of a robot that stands on uneven ground and shakes a little.

Usage: python examples/runtime.py [STEPS]
"""

import sys
import time

import numpy as np
from gaitshift.robot.motion import Motion

from gaitshift.control import Autonomous, Driver, policy
from gaitshift.shift import GaitGraph

RNG = np.random.default_rng(0)
STANCE = policy.load("trot").robot.stance_angles
FEET = np.array([[0.39, 0.25, 0.0], [0.39, -0.25, 0.0], [-0.39, 0.25, 0.0], [-0.39, -0.25, 0.0]])


def read_sensors() -> dict[str, np.ndarray]:
    """What state estimation and joint encoders of one robot say now; frames as in `Motion`."""
    shaken = RNG.normal(scale=0.01, size=12)
    return {
        "joint_position": STANCE + shaken,  # [rad], FL FR BL BR × HAA HFE KFE
        "joint_velocity": 10.0 * shaken,  # [rad/s]
        "joint_torque": np.full(12, 5.0),  # [N·m]
        "base_position_w": np.array([0.0, 0.0, 0.49]),  # [m]; only the height counts
        "base_quaternion_w": np.array([1.0, 0.0, 0.0, 0.0]),
        "base_linear_velocity_w": RNG.normal(scale=0.02, size=3),  # [m/s]
        "base_angular_velocity_b": RNG.normal(scale=0.02, size=3),  # [rad/s]
        "foot_position_w": FEET + RNG.normal(scale=0.002, size=(4, 3)),  # [m]
        "contact": RNG.random(4) < 0.5,
    }


def motion_of(sensors: dict[str, np.ndarray]) -> Motion:
    """The same for the package: one robot is a batch of one."""
    unseen = {  # what a policy never looks at
        "foot_velocity_w": np.zeros((4, 3)),
        "foot_force": np.zeros(4),
        "clearance": np.zeros(4),
        "body_contact": np.array(False),
    }
    return Motion(**{name: np.asarray(value)[None] for name, value in (sensors | unseen).items()})


def main(steps: int) -> float:
    """Runs the loop; gives the median time of a step [ms]."""
    graph = GaitGraph.load("terrain")  # trot on level ground, bound on rough
    driver = Driver({gait: policy.load(gait) for gait in graph.gaits}, 1, start=graph.start)
    higher_controller = Autonomous(graph, 1)
    command = driver.own_command()
    took = np.empty(steps)
    motion = motion_of(read_sensors())
    for step in range(steps):
        sensors = read_sensors()
        start = time.perf_counter()
        target = driver.act(motion, command)  # joint targets [rad], for your joint controllers
        motion = motion_of(sensors)
        driver.see(motion, command)
        decision = higher_controller.step(0.01 * step, motion, driver, command)
        command = driver.own_command()  # of the gait that is in force now
        took[step] = time.perf_counter() - start
        if step % 100 == 0:
            gait = driver.gaits[driver.gait[0]]
            k, beta = decision.k[0], decision.threshold[0]
            print(f"{step / 100:4.0f} s  {gait}, k {k:.0f} of {beta:.0f}, {target[0, :3].round(2)}")
    median = float(1000.0 * np.median(took))
    print(f"policy, machine, condition and switcher: {median:.3f} ms a step (median)")
    return median


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 1000)
