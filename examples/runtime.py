"""The loop on a robot: sensors in, joint targets out, gaits changed by the robot itself, at 100 Hz.

Nothing here needs a simulator: NumPy and onnxruntime are enough. `read_sensors` stands for your
robot; it gives what a robot senses that stands on uneven ground and shakes a little.

Usage: python examples/runtime.py [STEPS]
"""

import sys
import time

import numpy as np

from gaitshift.control import Autonomous, Driver
from gaitshift.robot import Proprioception
from gaitshift.shift import load_graph

RNG = np.random.default_rng(0)
FEET = np.array([[0.39, 0.25, 0.0], [0.39, -0.25, 0.0], [-0.39, 0.25, 0.0], [-0.39, -0.25, 0.0]])
BASE = np.array([0.0, 0.0, 0.49])


def read_sensors(stance: np.ndarray, seconds: float) -> Proprioception:
    """What encoders, inertial unit, feet and state estimation of one robot say: a batch of one."""
    shaken = RNG.normal(scale=0.01, size=(1, 12))
    return Proprioception(
        contact=RNG.random((1, 4)) < 0.5,  # FL FR BL BR
        foot_position_b=(FEET - BASE + RNG.normal(scale=0.002, size=(4, 3)))[None],  # [m]
        orientation=np.array([[1.0, 0.0, 0.0, 0.0]]),  # of the inertial unit (w, x, y, z)
        joint_position=stance + shaken,  # [rad], FL FR BL BR × HAA HFE KFE
        joint_velocity=10.0 * shaken,  # [rad/s]
        velocity_b=RNG.normal(scale=0.02, size=(1, 3)),  # [m/s]
        angular_velocity_b=RNG.normal(scale=0.02, size=(1, 3)),  # [rad/s]
        time=seconds,
    )


def main(steps: int) -> float:
    """Runs the loop; gives the median time of a step [ms]."""
    graph = load_graph()  # trot on level ground, bound on rough
    driver = Driver.load(graph.gaits, 1)
    higher_controller = Autonomous(graph, 1)
    stance = driver.robot.stance_angles
    command = driver.repertoire.own_command(driver.gait)
    took = np.empty(steps)
    sensed = read_sensors(stance, 0.0)
    for step in range(steps):
        next_sensed = read_sensors(stance, 0.01 * (step + 1))
        start = time.perf_counter()
        target = driver.act(sensed, command)  # joint targets [rad], for your joint controllers
        sensed = next_sensed
        driver.see(sensed, command)
        decision = higher_controller.step(sensed, driver)
        command = driver.repertoire.own_command(driver.gait)  # of the gait that is in force now
        took[step] = time.perf_counter() - start
        if step % 100 == 0:
            gait = driver.repertoire.gaits[driver.gait[0]]
            k, beta = decision.k[0], decision.threshold[0]
            print(f"{step / 100:4.0f} s  {gait}, k {k:.0f} of {beta:.0f}, {target[0, :3].round(2)}")
    median = float(1000.0 * np.median(took))
    print(f"policy, machine, condition and switcher: {median:.3f} ms a step (median)")
    return median


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 1000)
