"""`gaitshift demo`: a robot that shifts its gait by itself, as a folder to look at."""

import json
import shlex
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import tyro

from gaitshift.cli.output import check_folder, emit_json, emit_table, progress, say
from gaitshift.cli.robot_options import RobotOptions, SensorOption
from gaitshift.errors import GaitshiftError
from gaitshift.folder_lock import only_writer
from gaitshift.lab.evaluation import DemoConfig, run_demo
from gaitshift.lab.log import Log
from gaitshift.whole_file import write_text

PAGE, VIDEO, PICTURE = "index.html", "demo.mp4", "demo.png"
LOG, SUMMARY = "log.npz", "summary.json"


def _split(text: str) -> tuple[str, ...]:
    return tuple(part.strip() for part in text.split(",") if part.strip())


def _split_numbers(text: str) -> tuple[float, ...]:
    try:
        return tuple(float(part) for part in _split(text))
    except ValueError:
        raise GaitshiftError(
            f"at must be numbers separated by commas, such as 2,5,8, got '{text}'"
        ) from None


names_option = tyro.constructors.PrimitiveConstructorSpec[tuple[str, ...]](
    nargs=1,
    metavar="GAIT,GAIT,…",
    instance_from_str=lambda args: _split(args[0]),
    is_instance=lambda instance: isinstance(instance, tuple),
    str_from_instance=lambda instance: [",".join(instance)],
)
_numbers = tyro.constructors.PrimitiveConstructorSpec[tuple[float, ...]](
    nargs=1,
    metavar="S,S,…",
    instance_from_str=lambda args: _split_numbers(args[0]),
    is_instance=lambda instance: isinstance(instance, tuple),
    str_from_instance=lambda instance: [",".join(map(str, instance))],
)


def _split_speeds(text: str) -> tuple[tuple[float, float], ...]:
    try:
        pairs = [part.split("@") for part in _split(text)]
        return tuple((float(speed), float(seconds)) for speed, seconds in pairs)
    except ValueError:
        raise GaitshiftError(
            f"speeds must be SPEED@SECONDS separated by commas, such as 0.3@8,1.5@4, got '{text}'"
        ) from None


_speeds = tyro.constructors.PrimitiveConstructorSpec[tuple[tuple[float, float], ...]](
    nargs=1,
    metavar="M/S@S,…",
    instance_from_str=lambda args: _split_speeds(args[0]),
    is_instance=lambda instance: isinstance(instance, tuple),
    str_from_instance=lambda instance: [",".join(f"{v:g}@{t:g}" for v, t in instance)],
)


@dataclass(frozen=True, kw_only=True)
class Demo(RobotOptions, SensorOption, DemoConfig):
    """Simulate a robot that crosses flat and rough ground and shifts its gait by itself."""

    gaits: Annotated[tuple[str, ...], names_option] = ()
    """Gaits to show in sequence on a schedule, in place of the condition, such as
    trot,bound,pace,trot."""
    at: Annotated[tuple[float, ...], _numbers] = ()
    """Times of the shifts between these gaits [s], such as 2,5,8; by default every `every`
    seconds."""
    speeds: Annotated[tuple[tuple[float, float], ...], _speeds] = ()
    """Forward speeds that are commanded in turn on flat ground, each with its time, such as
    0.3@8,1.5@4 for 8 s at 0.3 m/s and 4 s at 1.5 m/s; in place of the track."""
    out: Path = Path("gaitshift-demo")
    """Folder for index.html, demo.mp4, demo.png, log.npz and summary.json."""
    overwrite: bool = False
    """Replace these files if the folder is not empty."""
    video: bool = True
    """Whether to render the video, which takes most of the time."""
    json: bool = False
    """One JSON object on stdout: the summary."""

    def run(self) -> None:
        """Runs, draws, and prints the path of the page."""
        _ = self.used  # raises an error before any work
        make = self.maker(self.controller)
        files = (PAGE, VIDEO, PICTURE, LOG, SUMMARY)
        with only_writer(self.out):
            check_folder(self.out, overwrite=self.overwrite, ours=files)
            with progress("walking") as report:
                log, summaries = run_demo(self, report, make=make)
            summary = self._summary(summaries)
            log.save(self.out / LOG)
            write_text(self.out / SUMMARY, json.dumps(summary, indent=2) + "\n")
            self._draw(log)
            written = [SUMMARY, PICTURE, LOG]
            if self.video and self._render(log):
                written.insert(0, VIDEO)
            self._report(log)
            written.insert(0, PAGE)
        if self.json:
            emit_json(summary)
            return
        _print(summary)
        print(f"results in {self.out}: {', '.join(written)}")

    def _summary(self, summaries: list[dict[str, Any]]) -> dict[str, Any]:
        """The first robot's summary, and those of all robots where there are several."""
        summary = {"seed": self.seed, **summaries[0]}
        if len(summaries) == 1:
            return summary
        shifts = [[(s["from"], s["to"]) for s in one["switches"]] for one in summaries]
        return {
            **summary,
            "episodes": len(summaries),
            "survived_count": sum(one["survived"] for one in summaries),
            "as_first_count": sum(
                one["survived"] and shift == shifts[0]
                for one, shift in zip(summaries, shifts, strict=True)
            ),
            "all": summaries,
        }

    def _draw(self, log: Log) -> None:
        from gaitshift.show.plots import demo_figure  # matplotlib is slow to import

        demo_figure(log, self.out / PICTURE)

    def _report(self, log: Log) -> None:
        from gaitshift.show.report import write_report

        video, command = self.out / VIDEO, shlex.join(["gaitshift", *sys.argv[1:]])
        facts = {"command": command, "seed": str(self.seed)}
        write_report(
            log,
            self.out / PAGE,
            description=self.read_robot(),
            video=video if self.video else None,
            facts=facts,
        )

    def _render(self, log: Log) -> bool:
        from gaitshift.show.video import VideoUnavailable, render

        try:
            with progress("filming") as report:
                render(log, self.out / VIDEO, description=self.read_robot(), report=report)
        except VideoUnavailable as error:
            say(f"no video: {error}")
            return False
        return True


def _print(summary: dict[str, Any]) -> None:
    rows = [
        ("survived", "yes" if summary["survived"] else "no"),
        ("distance", f"{summary['distance_m']:.1f} m in {summary['time_s']:.1f} s"),
        ("mean speed", f"{summary['mean_speed_m_s']:.2f} m/s"),
    ]
    for shift in summary["switches"]:
        where = f"{shift['from']} → {shift['to']}"
        rows.append(("shift", f"{where} at {shift['x_m']:.1f} m, {shift['time_s']:.1f} s"))
    if "episodes" in summary:
        rows.append(("survivors", f"{summary['survived_count']}/{summary['episodes']}"))
        rows.append(("survivors with the shifts of robot 0", f"{summary['as_first_count']}"))
    emit_table("demo", rows)
