"""What kills, failing system calls, damaged files and long runs do: docs/results/reliability.md.

Usage: python tools/reliability.py kills|calls|fuzz|steps|page [--tries N] [--seed N]

`kills` ends a command at random times with SIGKILL and gives it again until it is through; the
results must be those of a run that nothing ended. `calls` lets the n-th system call of a kind fail
(needs `strace`). `fuzz` gives damaged files to all readers. `steps` walks robots for 10 million
control steps. `page` serves the live page to two clients for half an hour. Each adds its rows to
docs/results/reliability.csv, and the page is written anew.
"""

import argparse
import csv
import hashlib
import json
import os
import random
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, field
from pathlib import Path
from types import FrameType

import numpy as np
import onnx

from gaitshift import table
from gaitshift.control import policy
from gaitshift.data import json_in
from gaitshift.errors import GaitshiftError
from gaitshift.gait import gaits
from gaitshift.lab.evaluation import EvaluationConfig
from gaitshift.lab.identification.log_files import passages
from gaitshift.lab.log import Log
from gaitshift.learn import progress
from gaitshift.learn.recipe import Recipe
from gaitshift.learn.settings import with_settings
from gaitshift.robot.robot_file import read_robot
from gaitshift.shift import load_graph

ROOT = Path(__file__).parent.parent
RESULTS = ROOT / "docs" / "results"
FOUND = ROOT / "out" / "reliability"
"""Where inputs that were read wrongly are kept."""

COLUMNS = ("check", "subject", "tries", "faults", "longest_s", "memory_mb", "note")
GAITSHIFT = (sys.executable, "-m", "gaitshift")
TRACEBACK = "Traceback (most recent call last)"


# Kills --------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Work:
    """A command with a folder of results, made small."""

    words: tuple[str, ...]
    """The command without its folder."""
    resume: tuple[str, ...] | None = None
    """The command that goes on, before the folder; None: the same command does."""
    logs: bool = False
    """Whether the log of a demonstration is its input."""


_TINY = ("--robots", "4", "--iterations", "12", "--threads", "1", "--set", "checkpoint_every=3")
WORKS = {
    "train": Work(("train", "trot", *_TINY), ("train", "--resume")),
    "reproduce": Work(("reproduce", "--quick")),
    "transitions": Work(("transitions", "trot", "bound", "--switches", "64")),
    "study": Work(("study", "--conditions", "terrain", "--amplitudes", "0.1", "--runs", "4")),
    "record": Work(("record", "trot", "--robots", "8", "--seconds", "3")),
    "identify": Work(("identify",), logs=True),
}


def kills(tries: int, seed: int) -> Iterator[table.Row]:
    """A row for each command: how often it was killed, and how often its results then differed."""
    rng = random.Random(seed)
    with tempfile.TemporaryDirectory() as place:
        log = Path(place) / "log"
        run([*GAITSHIFT, "demo", "--no-video", "--episodes", "4", "--out", str(log)])
        for name, work in WORKS.items():
            yield _killed(name, work, log / "log.npz", tries, rng)


def _killed(name: str, work: Work, log: Path, tries: int, rng: random.Random) -> table.Row:
    with tempfile.TemporaryDirectory() as place:
        whole, start = Path(place) / "whole", time.monotonic()
        run(_command(work, whole, log))
        longest = time.monotonic() - start
        expected = contents(whole)
        done = faults = runs = 0
        while done < tries:
            folder = Path(place) / f"killed-{runs}"
            done += _kill_until_through(work, folder, log, longest, rng)
            runs += 1
            if contents(folder) != expected:
                faults += 1
                shutil.copytree(folder, FOUND / f"{name}-{runs}", dirs_exist_ok=True)
            shutil.rmtree(folder)
    note = f"{runs} runs, each killed until it came through"
    return row("kill", name, done, faults, longest=longest, note=note)


def _kill_until_through(
    work: Work, folder: Path, log: Path, longest: float, rng: random.Random
) -> int:
    """The number of kills before the command came to its end; the later ones are kinder."""
    count = 0
    while True:
        wait = rng.uniform(0.0, longest * (1.0 + 0.3 * count))
        process = subprocess.Popen(
            _command(work, folder, log),
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            text=True,
            encoding="utf-8",
            start_new_session=True,
        )
        try:
            _, said = process.communicate(timeout=wait)
        except subprocess.TimeoutExpired:
            os.killpg(process.pid, signal.SIGKILL)
            process.communicate()
            count += 1
            continue
        if process.returncode:
            raise SystemExit(f"after {count} kills {' '.join(work.words)} failed:\n{said}")
        return count


def _command(work: Work, folder: Path, log: Path) -> list[str]:
    if work.resume is not None and (folder / "config.json").is_file():
        return [*GAITSHIFT, *work.resume, str(folder)]
    inputs = [str(log)] if work.logs else []
    return [*GAITSHIFT, *work.words, *inputs, "--out", str(folder)]


TIMES = ("wall_s", "seconds")
"""Columns that hold times of the clock."""


def contents(folder: Path) -> dict[str, str]:
    """Hashes of the results in a folder, by file; times of the clock left out."""
    return {
        str(path.relative_to(folder)): hashlib.sha256(_content(path)).hexdigest()
        for path in sorted(folder.rglob("*"))
        if path.suffix in (".csv", ".onnx", ".npz")
    }


def _content(path: Path) -> bytes:
    if path.suffix == ".csv":
        with path.open(newline="", encoding="utf-8") as file:
            rows = [{k: v for k, v in r.items() if k not in TIMES} for r in csv.DictReader(file)]
        return json.dumps(rows).encode()
    if path.suffix == ".npz":
        with np.load(path) as arrays:
            return b"".join(name.encode() + arrays[name].tobytes() for name in sorted(arrays))
    return onnx.load(
        path
    ).graph.SerializeToString()  # beside it stands the command, with its folder


# System calls -------------------------------------------------------------------------------------

CALLS = {"write": "ENOSPC", "openat": "EMFILE", "fsync": "EIO", "rename": "EACCES", "mkdir": "EIO"}
"""System calls, and how they fail."""


def calls(tries: int, seed: int) -> Iterator[table.Row]:
    """A row for each system call: how often a training in which one failed left a traceback.

    The n-th call of a kind fails, for n spread over all that a training makes. The training must
    end well or in one line, and another one must then come through in the same folder.
    """
    rng = random.Random(seed)
    work = WORKS["train"]
    for call, error in CALLS.items():
        with tempfile.TemporaryDirectory() as place:
            count = Path(place) / "count"
            counted = ["strace", "-f", "-qq", "-c", "-e", f"trace={call}", "-o", str(count)]
            run([*counted, *_command(work, Path(place) / "whole", Path())])
            made = _calls_in(count.read_text(encoding="utf-8"), call)
            faults, longest = 0, 0.0
            for number in sorted(rng.sample(range(1, made + 1), min(tries, made))):
                folder, start = Path(place) / str(number), time.monotonic()
                faults += _fails_badly(call, error, number, folder)
                longest = max(longest, time.monotonic() - start)
        note = f"{error}, among {made} calls of a training"
        yield row("call", call, min(tries, made), faults, longest=longest, note=note)


def _calls_in(summary: str, call: str) -> int:
    """The number of calls in a summary of strace."""
    (line,) = (line for line in summary.splitlines() if line.split()[-1:] == [call])
    return int(line.split()[3])


def _fails_badly(call: str, error: str, number: int, folder: Path) -> bool:
    work = WORKS["train"]
    inject = ["-e", f"inject={call}:error={error}:when={number}"]
    trace = ["strace", "-f", "-qq", "-e", f"trace={call}", *inject, "-o", "/dev/null"]
    first = subprocess.run(
        [*trace, *_command(work, folder, Path())],
        capture_output=True,
        text=True,
        encoding="utf-8",
        check=False,
    )
    second = subprocess.run(
        _command(work, folder, Path()),
        capture_output=True,
        text=True,
        encoding="utf-8",
        check=False,
    )
    said = first.stderr + second.stderr
    is_bad = TRACEBACK in said or second.returncode != 0
    if is_bad:
        FOUND.mkdir(parents=True, exist_ok=True)
        (FOUND / f"{call}-{number}.txt").write_text(said, encoding="utf-8")
    return is_bad


# Damaged files ------------------------------------------------------------------------------------

PONY = ROOT / "examples" / "robots" / "pony.toml"
LONGEST = 5.0
"""Longest that a file may take to be read or refused [s]."""


@dataclass(frozen=True)
class Reader:
    """A reader of files, one whole file, and its share of all tries."""

    read: Callable[[Path], object]
    source: Callable[[], bytes]
    share: float
    name: str = "a.toml"
    beside: tuple[Path, ...] = field(default=())
    """Files that the file names."""


def _log_file() -> bytes:
    from gaitshift.lab.evaluation import evaluate

    _, log = evaluate(policy.load("trot"), EvaluationConfig(episodes=1, seconds=2.2))
    with tempfile.TemporaryDirectory() as place:
        log.save(Path(place) / "log.npz")
        return (Path(place) / "log.npz").read_bytes()


def _walk_table() -> bytes:
    legs = ("FL", "FR", "BL", "BR")
    names = ["time", "rough", "gravity_x", "gravity_y", "gravity_z"]
    names += [f"contact_{leg}" for leg in legs]
    names += [f"foot_{leg}_{axis}" for leg in legs for axis in "xyz"]
    rows = [[round(0.01 * i, 2), 0, 0, 0, -1, 1, 0, 0, 1, *[0.1] * 12] for i in range(1, 20)]
    return "\n".join(",".join(map(str, line)) for line in [names, *rows]).encode()


PROGRESS = "iteration,stage,speed\n" + "".join(f"{i},flat,{i / 10}\n" for i in range(1, 20))

READERS = {
    "gait (TOML)": Reader(
        lambda path: gaits.load(str(path)), PONY.with_name("pony_trot.toml").read_bytes, 0.2
    ),
    "gait graph (TOML)": Reader(
        load_graph, (ROOT / "src/gaitshift/shift/graphs/terrain.toml").read_bytes, 0.2
    ),
    "recipe (TOML)": Reader(
        lambda path: with_settings(Recipe(), file=path),
        lambda: b'[ppo]\nepochs = 3\nhidden = [64, 32]\n[stages.flat]\nfidelity = "coarse"\n',
        0.2,
    ),
    "settings (JSON)": Reader(
        json_in, lambda: json.dumps({"seed": 1, "recipe": {"robots": [1, 2.5]}}).encode(), 0.12
    ),
    "progress of a training (CSV)": Reader(progress.read, PROGRESS.encode, 0.12, "a.csv"),
    "steps of a robot (CSV)": Reader(lambda path: list(passages(path)), _walk_table, 0.08, "a.csv"),
    "log (npz)": Reader(Log.load, _log_file, 0.05, "a.npz"),
    "robot (TOML)": Reader(
        read_robot, PONY.read_bytes, 0.01, "a.toml", (PONY.with_suffix(".xml"),)
    ),
    "robot's model (MJCF)": Reader(
        lambda path: read_robot(path.with_name("pony.toml")),
        PONY.with_suffix(".xml").read_bytes,
        0.01,
        "pony.xml",
        (PONY,),
    ),
    "policy (ONNX)": Reader(
        policy.load, lambda: policy.load("trot").path.read_bytes(), 0.01, "a.onnx"
    ),
}


class HangError(Exception):
    """A file took longer than it may."""


def fuzz(tries: int, seed: int) -> Iterator[table.Row]:
    """A row for each reader: tries, faults (a traceback, a hang, a crash), time and memory."""
    with ProcessPoolExecutor(max_workers=os.cpu_count(), max_tasks_per_child=1) as pool:
        shares = {name: round(reader.share * tries) for name, reader in READERS.items()}
        works = {name: pool.submit(_read_all, name, shares[name], seed) for name in READERS}
        for name, work in works.items():
            try:
                faults, longest, refused, memory = work.result()
            except Exception as error:  # the process died
                yield row("damaged file", name, shares[name], 1, note=f"ended by {error!r}")
                continue
            note = f"{refused / max(shares[name], 1):.2f} refused"
            yield row(
                "damaged file",
                name,
                shares[name],
                faults,
                longest=longest,
                memory=memory,
                note=note,
            )


def _read_all(name: str, tries: int, seed: int) -> tuple[int, float, int, float]:
    reader, rng = READERS[name], random.Random(f"{name} {seed}")
    signal.signal(signal.SIGALRM, _hang)
    faults = refused = 0
    longest = 0.0
    whole = reader.source()
    with tempfile.TemporaryDirectory() as place:
        for beside in reader.beside:
            shutil.copy(beside, place)
        path = Path(place) / reader.name
        for number in range(tries):
            content = damaged(whole, rng)
            path.write_bytes(content)
            start = time.perf_counter()
            signal.setitimer(signal.ITIMER_REAL, LONGEST)
            try:
                reader.read(path)
            except GaitshiftError as error:
                refused += 1
                is_fault = "\n" in str(error)
            except Exception:  # any other error is what is looked for
                is_fault = True
            else:
                is_fault = False
            signal.setitimer(signal.ITIMER_REAL, 0.0)
            longest = max(longest, time.perf_counter() - start)
            if is_fault:
                faults += 1
                FOUND.mkdir(parents=True, exist_ok=True)
                (FOUND / f"{name.split()[0]}-{seed}-{number}-{reader.name}").write_bytes(content)
    return faults, longest, refused, resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024


def _hang(number: int, frame: FrameType | None) -> None:
    raise HangError


PIECES = (b"nan", b"inf", b"1e308", b"-1", b"99999999999999999999", b"[[", b'"', b"\xff", b"\x00")


def damaged(content: bytes, rng: random.Random) -> bytes:
    """The content with one to four places overwritten, cut out, doubled or filled at random."""
    for _ in range(rng.randint(1, 4)):
        at, length = rng.randrange(len(content) + 1), rng.choice((0, 1, 1, 2, 4, 12, 64))
        kind = rng.randrange(4)
        if kind == 0:
            new = rng.choice(PIECES)
        elif kind == 1:
            new = rng.randbytes(rng.randint(1, 6))
        elif kind == 2:
            new = content[at : at + length] * 2
        else:
            new = b""
        content = content[:at] + new + content[at + length :]
    return content


# Long runs ----------------------------------------------------------------------------------------


def steps(tries: int, seed: int) -> Iterator[table.Row]:
    """Rows for each tenth of this many control steps: time a step, memory, and divergences."""
    from gaitshift.learn.learner import Learner
    from gaitshift.sim.env import GaitEnv
    from gaitshift.sim.terrain import from_spec

    robots = 128
    env = GaitEnv(gaits.load("trot"), from_spec("perlin:0.1", seed=seed), robots)
    learner = Learner(env, Recipe())
    learner.start_episodes(seed)
    walk = policy.load("trot")
    observation, _ = env.reset(seed=seed)
    for tenth in range(10):
        start, diverged = time.perf_counter(), 0
        count = tries // robots // 10
        for _ in range(count):
            observation, *_, info = env.step(walk(observation))
            diverged += int(info["diverged"].sum())
        took = (time.perf_counter() - start) / count
        memory = _memory_of(os.getpid())
        note = f"{1e3 * took:.2f} ms a step of {robots} robots"
        yield row("steps", f"tenth {tenth + 1}", count * robots, diverged, memory=memory, note=note)


def _memory_of(process: int) -> float:
    """Memory of a process [MB]."""
    status = Path(f"/proc/{process}/status").read_text(encoding="utf-8")
    return int(status.split("VmRSS:")[1].split()[0]) / 1024


def page(tries: int, seed: int) -> Iterator[table.Row]:
    """Rows for each of six parts of this many seconds of the live page with two clients."""
    import viser
    from websockets.sync.client import connect
    from websockets.typing import Subprotocol

    port, protocol = 8099, Subprotocol(f"viser-v{viser.__version__}")
    command = [*GAITSHIFT, "view", "--port", str(port), "--seed", str(seed)]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True, encoding="utf-8")
    assert process.stdout is not None
    assert any("open http" in line for line in iter(process.stdout.readline, ""))
    try:
        address = f"ws://127.0.0.1:{port}"
        clients = [connect(address, subprotocols=[protocol], max_size=None) for _ in range(2)]
        for part in range(6):
            until, received = time.monotonic() + tries / 6, 0
            while time.monotonic() < until:
                for one in clients:
                    received += len(one.recv())
            memory = _memory_of(process.pid)
            note = f"{received / 2 / (tries / 6) / 1e3:.0f} kB/s to each client"
            yield row("page", f"part {part + 1}", tries // 6, 0, memory=memory, note=note)
    finally:
        process.send_signal(signal.SIGINT)
        process.wait()


# The page -----------------------------------------------------------------------------------------

HEAD = """# What survives kills, full disks and damaged files?

{answer}

- **kill**: the command is killed at random times and given again until it is through; a fault is a
  result that differs from that of a run that nothing ended.
- **call**: one system call of a training fails; a fault is a traceback, or a folder in which the
  training cannot go on.
- **damaged file**: a fault is a traceback, more than one line, or more than {limit:g} s.
- **steps**: 128 robots on noise of 0.1 m; a fault is a simulation that diverged.
- **page**: `gaitshift view` with two clients.

Each row is made by `python tools/reliability.py CHECK --tries N`.

"""


def row(
    check: str,
    subject: str,
    tries: int,
    faults: int,
    *,
    longest: float | None = None,
    memory: float | None = None,
    note: str = "",
) -> table.Row:
    """A row of the table."""
    longest_s = "" if longest is None else round(longest, 2)
    memory_mb = "" if memory is None else round(memory)
    return dict(
        zip(COLUMNS, (check, subject, tries, faults, longest_s, memory_mb, note), strict=True)
    )


def write_page(rows: list[table.Row]) -> None:
    """The table, and the page with its answer."""
    table.write(RESULTS / "reliability.csv", rows, COLUMNS)
    tries = sum(int(one["tries"]) for one in rows if one["check"] in ("kill", "call"))
    files = sum(int(one["tries"]) for one in rows if one["check"] == "damaged file")
    faults = sum(int(one["faults"]) for one in rows)
    answer = (
        f"{tries} kills and failing system calls and {files} damaged files caused {faults or 'no'} "
        f"fault{'' if faults == 1 else 's'}."
    )
    text = HEAD.format(answer=answer, limit=LONGEST)
    cells = [tuple(str(one[name]) for name in COLUMNS) for one in rows]
    text += table.markdown(COLUMNS, cells) + "\n"
    (RESULTS / "reliability.md").write_text(text, encoding="utf-8")


def run(command: list[str]) -> None:
    """Runs a command that must succeed."""
    done = subprocess.run(command, capture_output=True, text=True, encoding="utf-8", check=False)
    if done.returncode:
        raise SystemExit(f"{' '.join(command)} failed:\n{done.stderr}")


CHECKS: dict[str, tuple[Callable[[int, int], Iterator[table.Row]], int, str]] = {
    "kills": (kills, 50, "kill"),
    "calls": (calls, 12, "call"),
    "fuzz": (fuzz, 1_000_000, "damaged file"),
    "steps": (steps, 10_000_000, "steps"),
    "page": (page, 1800, "page"),
}
"""Each check, its usual number of tries, and how its rows are called."""


def main() -> None:
    """Makes one check, and adds its rows."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("check", choices=CHECKS)
    parser.add_argument("--tries", type=int)
    parser.add_argument("--seed", type=int, default=0)
    asked = parser.parse_args()
    check, usual, called = CHECKS[asked.check]
    found: list[table.Row] = []
    for one in check(asked.tries or usual, asked.seed):
        print(one, flush=True)
        found.append(one)
        _keep(found, called)


def _keep(found: list[table.Row], called: str) -> None:
    """Puts the rows of a check in the place of its earlier ones."""
    path = RESULTS / "reliability.csv"
    earlier = [dict(one) for one in table.read(path)] if path.is_file() else []
    rows = [*(one for one in earlier if one["check"] != called), *found]
    order = [name for *_, name in CHECKS.values()]
    write_page(sorted(rows, key=lambda one: order.index(one["check"])))


if __name__ == "__main__":
    main()
