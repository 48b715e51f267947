"""Makes the pages in the folders of docs/results/shifting, from the shipped policies.

Usage: python tools/shifting_evidence.py [PAGE...]

Runs the command on each named page, or on all pages, and records the logs that it needs first. All
pages take four to five hours on two cores. If it is interrupted, the same command resumes
(runs/shifting, 4 GB; remove it after policies have changed). Interactive pages of `identify` above
`LARGEST` are left out. The pages docs/results/shifting/*.md are written by hand, except for
trained-on-shifts.md.
"""

import argparse
import shutil
import subprocess
import sys
from pathlib import Path

WORK = Path("runs/shifting")
RESULTS = Path(__file__).parent.parent / "docs" / "results" / "shifting"
LARGEST = 200_000
"""Largest interactive page that is copied [bytes]."""
ITS_LINK = " The same as an [interactive page](page.html)."

SLOPES = ("across-10", "down-10", "down-15", "up-10", "up-15")
SMOOTH = (*SLOPES, "flat", "pebbles-4cm", "steps-5cm")
AMPLITUDES = ("0.05", "0.07", "0.10", "0.15", "0.20")
NOISE = tuple(f"into-{a}" for a in AMPLITUDES)
WAY_BACK = tuple(f"out-of-{a}" for a in AMPLITUDES)
ROUGHER = ("0.25", "0.30", "0.40")
"""Amplitudes above those of the standard courses, for the paper's numbers [m]."""
OSCILLATORS = {
    "down-5": "slope:-5@8",
    "flat": "flat@12",
    "into-0.05": "flat@3,perlin:0.05@6",
    "pebbles-2cm": "flat@2,pebbles:0.02@6",
    "step-2cm": "flat@2,step:0.02@4",
}


def logs(gait: str, courses: tuple[str, ...], *seeds: int) -> list[str]:
    """Files of these courses, sorted by name within a seed."""
    return [f"logs/{gait}-{course}-{seed}.npz" for seed in seeds for course in sorted(courses)]


CHOOSING = logs("trot", (*SMOOTH, "into-0.10", "into-0.15", "into-0.20"), 0, 1)
FOREIGN = logs("trot", (*SMOOTH, "into-0.10"), 2, 3, 4)
SECOND = logs("trot", (*SMOOTH, "stairs-5cm", *NOISE), 2)
AUDITED = [
    *sorted(logs("trot", NOISE, 0, 1)),
    *logs("trot", tuple(f"into-{a}" for a in ROUGHER), 0),
]

IDENTIFIED = {
    "identify-rough": [*CHOOSING, "--held-out", *SECOND, "--condition", "all"],
    "identify-flat": [
        *logs("bound", WAY_BACK, 0),
        *("--held-out", *logs("bound", WAY_BACK, 1)),
        *("--way", "flat", "--condition", "all"),
    ],
    "flat-numbers": [
        *logs("bound", WAY_BACK, 1),
        *("--way", "flat", "--condition", "height_difference"),
        *("--alpha", "0.0055", "--beta", "18", "--leak", "0.12"),
    ],
    "three-seeds": [
        *CHOOSING,
        *("--held-out", *FOREIGN),
        *("--condition", "paper", "touchdown_surprise"),
    ],
    "fresh-seed": [
        *logs("trot", (*SMOOTH, "into-0.10"), 4),
        *("--condition", "touchdown_surprise", "--alpha", "0.0124", "--beta", "8"),
    ],
    "our-numbers": [
        *SECOND,
        *("--condition", "height_difference", "--alpha", "0.04", "--beta", "200"),
    ],
    "paper-numbers": [
        *AUDITED,
        *("--condition", "paper", "height_difference", "--alpha", "0.2", "--beta", "1000"),
    ],
    "oscillators": [
        *logs("oscillators", tuple(OSCILLATORS), 0),
        *("--held-out", *logs("oscillators", tuple(OSCILLATORS), 1)),
        *("--condition", "all"),
    ],
}
STUDIED = {
    "transitions": ["transitions", "--switches", "2000"],
    "transitions-all": ["transitions", "all"],
    "study": ["study"],
}


def gaitshift(*arguments: str | Path) -> None:
    """Runs one command of the package in `WORK`."""
    subprocess.run([sys.executable, "-m", "gaitshift", *map(str, arguments)], cwd=WORK, check=True)


def record(page: str) -> None:
    """Records the missing logs of a page."""
    for log in IDENTIFIED[page]:
        if not log.endswith(".npz") or (WORK / log).is_file():
            continue
        gait, rest = Path(log).stem.split("-", 1)
        course, seed = rest.rsplit("-", 1)
        if gait == "oscillators":
            track = OSCILLATORS[course]
            walk(log, "--controller", "cpg", "--track", track, robots=32, seed=1000 * int(seed))
        elif course.removeprefix("into-") in ROUGHER:
            walk(log, "--track", f"flat@3,perlin:{course[-4:]}@20,flat@1", robots=64, seed=0)
        else:
            gaitshift("record", gait, "--courses", course, "--seed", seed, "--out", "logs")


def walk(log: str, *what: str, robots: int, seed: int) -> None:
    """Records a walk without a shift: no value of a statistic reaches an α of 9."""
    crowd = ("--episodes", str(robots), "--seed", str(seed), "--no-video")
    gaitshift("demo", "--alpha", "9", *what, *crowd, "--out", "walk", "--overwrite")
    (WORK / "logs").mkdir(exist_ok=True)
    (WORK / "walk" / "log.npz").replace(WORK / log)


def make(page: str) -> None:
    """Makes the folder of a page."""
    if page in STUDIED:
        gaitshift(*STUDIED[page], "--out", f"docs/results/shifting/{page}")
        made = WORK / "docs" / "results" / "shifting" / page
    else:
        record(page)
        made = WORK / page
        if not (made / "README.md").is_file():
            gaitshift("identify", *IDENTIFIED[page], "--out", page, "--overwrite")
    shutil.rmtree(RESULTS / page, ignore_errors=True)
    shutil.copytree(made, RESULTS / page)
    hover = RESULTS / page / "page.html"
    if page in IDENTIFIED and hover.stat().st_size > LARGEST:
        hover.unlink()
        text = RESULTS / page / "README.md"
        text.write_text(text.read_text(encoding="utf-8").replace(ITS_LINK, ""), encoding="utf-8")


def main() -> None:
    """Makes the named pages, or all."""
    pages = [*IDENTIFIED, *STUDIED]
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("pages", nargs="*", metavar="PAGE", help=f"of {', '.join(pages)}")
    chosen = parser.parse_args().pages or pages
    unknown = [page for page in chosen if page not in pages]
    if unknown:
        parser.error(f"no page '{unknown[0]}'; pages are {', '.join(pages)}")
    WORK.mkdir(parents=True, exist_ok=True)
    for page in chosen:
        make(page)


if __name__ == "__main__":
    main()
