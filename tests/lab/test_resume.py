"""Work in parts is done once, whatever ends the process in between."""

from contextlib import contextmanager, suppress

import pytest

from gaitshift.errors import GaitshiftError
from gaitshift.lab.resume import Part, ResumableTable, run_missing

COLUMNS = {"gait": str, "ground": str, "seed": int, "falls": int}
KEYS = [(gait, ground) for gait in ("trot", "pace") for ground in ("flat", "noise")]


class KilledError(Exception):
    """Stands for the end of the process."""


@contextmanager
def no_progress(name):
    del name
    yield lambda done, total: None


def opened(path, **options):
    options = {"key": ("gait", "ground"), "same": {"seed": 0}} | options
    return ResumableTable.open(path, COLUMNS, "falls", **options)


def run(path, *, killed_at=None):
    """Runs the work of all keys; gives the keys that were worked on, and what was said."""
    table, done, said = opened(path), [], []

    def work(key):
        if len(done) == killed_at:
            raise KilledError
        done.append(key)
        return {"gait": key[0], "ground": key[1], "seed": 0, "falls": len("".join(key))}

    parts = [table.part(key, " on ".join(key), lambda _, key=key: work(key)) for key in KEYS]
    with suppress(KilledError):
        run_missing(parts, progress=no_progress, say=said.append)
    return done, said


@pytest.mark.parametrize("killed_at", range(5))
def test_a_killed_call_and_the_next_one_do_each_part_once_and_write_the_same_file(
    killed_at, tmp_path
):
    run(tmp_path / "whole" / "falls.csv")
    path = tmp_path / "killed" / "falls.csv"
    first, _ = run(path, killed_at=killed_at)
    second, said = run(path)
    assert first + second == KEYS
    assert said == [f"{gait} on {ground} exists, not repeated" for gait, ground in first]
    assert path.read_bytes() == (tmp_path / "whole" / "falls.csv").read_bytes()


def test_rows_come_in_the_order_of_the_parts_found_or_made():
    parts = [
        Part(name="found", find=lambda: {"n": 1}, work=lambda report: {"n": 0}),
        Part(name="made", find=lambda: None, work=lambda report: {"n": 2}),
    ]
    rows = run_missing(parts, progress=no_progress, say=lambda line: None)
    assert rows == [{"n": 1}, {"n": 2}]


def test_a_part_reports_to_the_progress_of_its_name():
    shown = []

    @contextmanager
    def progress(name):
        yield lambda done, total: shown.append((name, done, total))

    part = Part(name="trot", find=lambda: None, work=lambda report: report(3, 8) or {})
    run_missing([part], progress=progress, say=lambda line: None)
    assert shown == [("trot", 3, 8)]


def test_rows_of_another_measurement_are_refused_unless_it_begins_anew(tmp_path):
    path = tmp_path / "falls.csv"
    run(path)
    before = path.read_bytes()
    with pytest.raises(GaitshiftError, match=r"seed must be 0 to add to .*, got 3"):
        opened(path, same={"seed": 3})
    assert path.read_bytes() == before
    assert len(opened(path).rows) == len(KEYS)
    assert opened(path, same={"seed": 3}, overwrite=True).rows == []
