"""`gaitshift robot-sim`: a simulated robot on the other side of a UDP socket."""

import json
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from gaitshift.cli.deploy import CONTROLLER_PORT, ROBOT_PORT, SUMMARY, timing_rows
from gaitshift.cli.output import check_folder, emit_json, emit_table, say
from gaitshift.cli.robot_options import RobotOption, SensorOption
from gaitshift.control.deployment import DeploymentConfig, Timing, UdpLink
from gaitshift.errors import GaitshiftError
from gaitshift.folder_lock import only_writer
from gaitshift.lab.deployment import RobotRecorder, run_robot
from gaitshift.lab.evaluation.demo import START, WIDTH, summarise
from gaitshift.lab.log import Log
from gaitshift.sim.channel import Channel, ChannelConfig
from gaitshift.sim.simulated_robot import SimulatedRobot
from gaitshift.sim.terrain import from_spec
from gaitshift.sim.world import World
from gaitshift.whole_file import write_text

LOG = "log.npz"

_LENGTH = 50.0
"""Length of a ground of one piece without a length [m]; ours: half a minute of walking."""


@dataclass(frozen=True, kw_only=True)
class RobotSim(RobotOption, SensorOption, ChannelConfig):
    """Simulate a robot in real time that is reached by datagrams, for `deploy`.

    It stands until the first command. When its controller stops, it is simulated for two seconds
    more and leaves its log. Where commands end without a stop, it damps its joints for good.
    """

    terrain: str = "flat"
    """The ground: one piece, or several with lengths in metres, as in `evaluate --terrain`."""
    gains: str = "default"
    """Preset of the joint controllers' gains."""
    watchdog: float = DeploymentConfig.watchdog
    """Longest time without a valid command before the joints are damped [s]."""
    seed: int = 0
    """Seed of the ground, of the sensors' errors, and of the delays and losses of datagrams."""
    peer: str = f"127.0.0.1:{CONTROLLER_PORT}"
    """Address of the controller, HOST:PORT; datagrams of others are dropped."""
    host: str = "127.0.0.1"
    """Address to listen on; datagrams are not authenticated, so choose another one only on a
    network that you trust."""
    port: int = ROBOT_PORT
    """Port to listen on."""
    out: Path = Path("gaitshift-robot")
    """Folder for log.npz and summary.json."""
    overwrite: bool = False
    """Replace these files if the folder is not empty."""
    json: bool = False
    """One JSON object on stdout: the summary."""

    def run(self) -> None:
        """Simulates the robot until its controller has stopped, and writes its log."""
        world, ways = self._world(), np.random.default_rng(self.seed).spawn(2)
        robot = SimulatedRobot(world, gains=self.gains, watchdog=self.watchdog)
        sensors, commands = (Channel(self, rng) for rng in ways)
        recorder, timing = RobotRecorder(robot), Timing()
        with only_writer(self.out), UdpLink(self.host, self.port, self.peer) as link:
            check_folder(self.out, overwrite=self.overwrite, ours=(LOG, SUMMARY))
            say(f"standing on {self.host}:{self.port}, waiting for commands of {self.peer}")
            try:
                run_robot(
                    robot,
                    link,
                    sensors=sensors,
                    commands=commands,
                    timing=timing,
                    see=recorder.add,
                )
            finally:
                log = recorder.log()
                if log is not None:
                    self._keep(log, {"datagrams": asdict(robot.inbox.counts), **timing.summary()})
        if robot.is_lost:
            silence = 1000.0 * self.watchdog
            raise GaitshiftError(
                f"no valid command of {self.peer} for {silence:.0f} ms; the joints were damped"
            )

    def _world(self) -> World:
        robot = self.read_robot()
        ground = from_spec(self.terrain, seed=self.seed, length=_LENGTH, width=WIDTH)
        world = World(
            robot,
            ground,
            1,
            gains=self.gains,
            threads=1,
            sensors=self.sensors,
            seed=self.seed,
        )
        world.place(np.arange(1), xy=np.array([[START, 0.0]]), yaw=np.zeros(1))
        return world

    def _keep(self, log: Log, measured: dict[str, Any]) -> None:
        """Writes the log and the summary, and prints it."""
        summary = {"seed": self.seed, **summarise(log, 0), **measured}
        log.save(self.out / LOG)
        write_text(self.out / SUMMARY, json.dumps(summary, indent=2) + "\n")
        if self.json:
            emit_json(summary)
            return
        datagrams = measured["datagrams"]
        rows = [
            ("survived", "yes" if summary["survived"] else "no"),
            ("distance", f"{summary['distance_m']:.1f} m in {summary['time_s']:.1f} s"),
            ("datagrams", ", ".join(f"{count} {name}" for name, count in datagrams.items())),
            *timing_rows(summary),
        ]
        emit_table("robot", rows)
        print(f"results in {self.out}: {LOG}, {SUMMARY}")
