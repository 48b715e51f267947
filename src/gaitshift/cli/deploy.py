"""`gaitshift deploy`: the control loop of a robot on the other side of a UDP socket."""

import json
from dataclasses import asdict, dataclass
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Any

from gaitshift.cli.demo import names_option
from gaitshift.cli.output import check_folder, emit_json, emit_table, say
from gaitshift.cli.robot_options import RobotOptions
from gaitshift.control import Autonomous, Scheduled, Switcher
from gaitshift.control.deployment import (
    ControlStep,
    Deployment,
    DeploymentConfig,
    Timing,
    UdpLink,
    run,
)
from gaitshift.data import check_ranges
from gaitshift.folder_lock import only_writer
from gaitshift.lab.deployment import SensedTable
from gaitshift.robot.command import CONTROL_PERIOD
from gaitshift.shift import load_graph
from gaitshift.shift.graph_file import DEFAULT
from gaitshift.whole_file import write_text

ROBOT_PORT, CONTROLLER_PORT = 9870, 9871
"""Ports of the robot and of its controller; ours: no service is registered there."""

TABLE, SUMMARY = "sensed.csv", "summary.json"


@dataclass(frozen=True, kw_only=True)
class Deploy(RobotOptions, DeploymentConfig):
    """Drive a robot that is reached by datagrams, at 100 Hz, and stop it softly.

    Policies, condition and switcher run here; sensors arrive and joint targets leave as UDP
    datagrams. `gaitshift robot-sim` in another terminal is such a robot. The run ends after
    `seconds`, after Ctrl-C, or when no sensors arrive any more, always with a soft stop: the
    targets go to the present joint angles while the stiffness of the joints fades to 0 in a second.
    """

    graph: str = DEFAULT
    """When to shift: a shipped gait graph by name, or a TOML file."""
    gaits: Annotated[tuple[str, ...], names_option] = ()
    """Gaits in sequence on a schedule, in place of the graph, such as trot,bound; one alone is
    walked without shifts."""
    every: float = 3.0
    """Time between two shifts of `gaits` [s]."""
    peer: str = f"127.0.0.1:{ROBOT_PORT}"
    """Address of the robot, HOST:PORT; datagrams of others are dropped."""
    host: str = "127.0.0.1"
    """Address to listen on; datagrams are not authenticated, so choose another one only on a
    network that you trust."""
    port: int = CONTROLLER_PORT
    """Port to listen on."""
    seconds: float = 30.0
    """Time to walk, before the soft stop [s]."""
    wait: float = 10.0
    """Longest time until the first sensors [s]."""
    out: Path = Path("gaitshift-deploy")
    """Folder for sensed.csv and summary.json."""
    overwrite: bool = False
    """Replace these files if the folder is not empty."""
    json: bool = False
    """One JSON object on stdout: the summary."""

    def __post_init__(self) -> None:
        super().__post_init__()
        check_ranges(self, every=(0.2, 60.0), seconds=(0.1, 3600.0), wait=(0.1, 3600.0))

    def run(self) -> None:
        """Drives the robot, writes the table, and prints what was measured."""
        gaits, switcher = self._gaits_and_switcher()
        deployment = Deployment(self.maker("policy")(gaits, 1), switcher, self)
        table, timing = SensedTable(deployment.controller.repertoire.gaits), Timing()
        course = list[ControlStep]()

        def see(step: ControlStep) -> None:
            table.add(step)
            if not course or step.gait != course[-1].gait:
                course.append(step)

        with only_writer(self.out), UdpLink(self.host, self.port, self.peer) as link:
            check_folder(self.out, overwrite=self.overwrite, ours=(TABLE, SUMMARY))
            say(f"waiting for sensors of {self.peer} on {self.host}:{self.port}")
            try:
                run(
                    deployment,
                    link,
                    seconds=self.seconds,
                    wait=self.wait,
                    timing=timing,
                    see=see,
                )
            finally:
                if deployment.last is not None:
                    summary = _summary(deployment, timing, course)
                    table.write(self.out / TABLE)
                    write_text(self.out / SUMMARY, json.dumps(summary, indent=2) + "\n")
                    self._print(summary)

    def _gaits_and_switcher(self) -> tuple[tuple[str, ...], Switcher]:
        if not self.gaits:
            graph = load_graph(self.graph)
            return graph.gaits, Autonomous(graph, 1)
        plan = ((self.every * number, gait) for number, gait in enumerate(self.gaits) if number)
        return tuple(dict.fromkeys(self.gaits)), Scheduled(tuple(plan))

    def _print(self, summary: dict[str, Any]) -> None:
        if self.json:
            emit_json(summary)
            return
        datagrams = summary["datagrams"]
        shifts = summary["switches"]
        rows = [
            ("walked", f"{summary['time_s']:.2f} s"),
            *(("shift", f"{s['from']} → {s['to']} at {s['time_s']:.2f} s") for s in shifts),
            ("datagrams", ", ".join(f"{count} {name}" for name, count in datagrams.items())),
            *timing_rows(summary),
        ]
        emit_table("deployment", rows)
        print(f"results in {self.out}: {TABLE}, {SUMMARY}")


def timing_rows(summary: dict[str, Any]) -> list[tuple[str, str]]:
    """Rows of a table for the times that were measured."""
    rows = [("deadline misses", str(summary["deadline_misses"]))]
    for name in ("jitter", "work", "round_trip"):
        times: dict[str, float] | None = summary[f"{name}_ms"]
        if times is not None:
            cells = ", ".join(f"{of} {value:.2f}" for of, value in times.items())
            rows.append((f"{name.replace('_', ' ')} [ms]", cells))
    return rows


def _summary(deployment: Deployment, timing: Timing, course: list[ControlStep]) -> dict[str, Any]:
    gaits, last = deployment.controller.repertoire.gaits, deployment.last
    assert last is not None
    return {
        "time_s": round(float(last.sensed.time) + CONTROL_PERIOD, 2),
        "fault": deployment.fault,
        "switches": [
            {
                "time_s": round(float(after.sensed.time), 2),
                "from": gaits[before.gait],
                "to": gaits[after.gait],
            }
            for before, after in pairwise(course)
        ],
        "datagrams": asdict(deployment.inbox.counts),
        **timing.summary(),
    }
