"""Time of one robot's control step: estimator, policy, condition and datagrams, without a link."""

import time
from collections.abc import Callable
from statistics import median
from typing import Any

import numpy as np

from gaitshift.control import Autonomous, Driver
from gaitshift.control.deployment import Deployment, DeploymentConfig
from gaitshift.control.estimator import Estimation
from gaitshift.robot.state import Proprioception
from gaitshift.shift import load_graph
from gaitshift.sim.sensor_config import ANYMAL
from gaitshift.sim.simulated_robot import SimulatedRobot
from gaitshift.sim.terrain import flat
from gaitshift.sim.world import World

POLICIES, GRAPH = ("deployable/trot", "deployable/bound"), "sensors"
WARM_UP = 100
"""First control steps, which are left out."""


def step_times(steps: int = 1000, seed: int = 0) -> dict[str, float]:
    """Medians over the control steps of a robot that trots on flat ground [ms].

    `control_step` is all that `gaitshift deploy` computes from a datagram to its answer. Of its
    parts `estimator`, `policy` and `condition` are measured alone, on what the robot sensed.
    `physics` is the step of the simulated robot.
    """
    driver = Driver.load(POLICIES, 1)
    graph = load_graph(GRAPH)
    deployment = Deployment(driver, Autonomous(graph, 1), DeploymentConfig())
    world = World(driver.robot, flat(20.0, 20.0), 1, threads=1, sensors=ANYMAL, seed=seed)
    robot = SimulatedRobot(world, gains=driver.gains, watchdog=1.0)
    taken = dict[str, list[float]]()

    def timed(name: str, work: Callable[[], Any]) -> Any:
        start = time.perf_counter()
        done = work()
        taken.setdefault(name, []).append(1e3 * (time.perf_counter() - start))
        return done

    def control(data: bytes, now: float) -> bytes | None:
        deployment.receive(data, now)
        return deployment.step(now)

    sensed = list[Proprioception]()
    for step in range(WARM_UP + steps):
        now = 0.01 * step
        data = robot.sensors(now)
        answer = timed("control_step", lambda data=data, now=now: control(data, now))
        if answer is not None:
            robot.receive(answer, now)
        timed("physics", lambda now=now: robot.step(now))
        if deployment.last is not None:
            sensed.append(deployment.last.sensed)
    estimation, state = Estimation(driver.robot, 1), graph.begin(1)
    command = driver.repertoire.own_command(np.zeros(1, dtype=np.int64))
    for one in sensed:
        blind = one.having(velocity_b=None)
        timed("estimator", lambda blind=blind: estimation.see(blind))
        timed("policy", lambda one=one: (driver.see(one, command), driver.act(one, command)))
        state, _ = timed("condition", lambda one=one, state=state: graph.step(state, one))
    return {name: median(of[WARM_UP:]) for name, of in taken.items()}
