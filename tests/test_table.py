"""Tables as files: the bytes that are written, what is read back, and what is refused."""

from pathlib import Path

import numpy as np
import pytest

from gaitshift.errors import GaitshiftError
from gaitshift.lab.studies import crossing, transitions
from gaitshift.table import append, markdown, read, read_typed, stream, write

ROOT = Path(__file__).parent.parent
RESULTS = ROOT / "docs" / "results"
POLICIES = ROOT / "src" / "gaitshift" / "control" / "policies"
COMMITTED = sorted([*RESULTS.rglob("*.csv"), *POLICIES.glob("*.csv")])


@pytest.mark.parametrize("path", COMMITTED, ids=lambda path: str(path.relative_to(ROOT)))
def test_a_committed_table_is_written_byte_for_byte_as_it_was_read(path, tmp_path):
    again = tmp_path / path.name
    write(again, read(path))
    assert again.read_bytes() == path.read_bytes()


def test_a_table_has_a_line_feed_behind_each_row_and_nothing_for_none(tmp_path):
    path = tmp_path / "table.csv"
    write(path, [{"a": 1, "b": None}, {"a": "x, y", "b": 0.5}])
    assert path.read_bytes() == b'a,b\n1,\n"x, y",0.5\n'
    assert [file.name for file in tmp_path.iterdir()] == ["table.csv"]


def test_columns_that_are_named_stand_in_their_order_even_without_rows(tmp_path):
    path = tmp_path / "table.csv"
    write(path, [], ("b", "a"))
    assert path.read_bytes() == b"b,a\n"
    write(path, [{"a": 1, "b": 2}], ("b", "a"))
    assert path.read_bytes() == b"b,a\n2,1\n"


def test_a_table_that_grows_is_the_one_that_is_written_whole(tmp_path):
    rows = [{"iteration": 1, "stage": "flat, still"}, {"iteration": 2, "stage": None}]
    grown, whole = tmp_path / "grown.csv", tmp_path / "whole.csv"
    for number, row in enumerate(rows, start=1):
        append(grown, row)
        write(whole, rows[:number])
        assert grown.read_bytes() == whole.read_bytes()


WHOLE = b'a,b\n1,"no, none"\n3,50\n'


@pytest.mark.parametrize("size", range(len(WHOLE)))
def test_of_a_table_cut_at_any_byte_the_rows_with_a_line_end_are_read(size, tmp_path):
    """50 cut to 5 would be a row of other numbers."""
    path, rows = tmp_path / "progress.csv", [{"a": "1", "b": "no, none"}, {"a": "3", "b": "50"}]
    path.write_bytes(WHOLE[:size])
    ends = [at for at in range(len(WHOLE)) if WHOLE[at : at + 1] == b"\n"]
    assert read(path, may_be_cut=True) == rows[: max(0, sum(at < size for at in ends) - 1)]


def test_a_cut_last_row_is_damage_in_a_table_that_is_written_whole(tmp_path):
    path = tmp_path / "runs.csv"
    for cut in (b"a,b\n1,2\n3", b"a,b\n1,2\n3,5"):
        path.write_bytes(cut)
        with pytest.raises(GaitshiftError, match=r"runs\.csv, line 3 is damaged"):
            read(path)


def test_a_row_of_a_study_that_is_cut_in_its_last_cell_is_not_taken_as_whole(tmp_path):
    path, columns = tmp_path / "falls.csv", {"gait": str, "falls": int}
    rows = [{"gait": "trot", "falls": 10}, {"gait": "pace", "falls": 25}]
    write(path, rows, columns)
    path.write_bytes(path.read_bytes()[:-2])
    assert read_typed(path, columns, "falls") == rows[:1]


@pytest.mark.parametrize("text", ["a,b\n1,2,3\n4,5\n", "a,b\n1\n2,3\n"])
def test_a_row_of_other_cells_than_the_first_line_names_is_damage(text, tmp_path):
    path = tmp_path / "table.csv"
    path.write_text(text)
    with pytest.raises(GaitshiftError, match=r"table\.csv, line 2 is damaged"):
        read(path, may_be_cut=True)


def test_a_file_that_cannot_be_read_is_named(tmp_path):
    with pytest.raises(GaitshiftError, match=r"none\.csv cannot be read"):
        read(tmp_path / "none.csv")
    (tmp_path / "bytes.csv").write_bytes(b"a,b\n\xff,1\n")
    with pytest.raises(GaitshiftError, match=r"bytes\.csv is damaged"):
        read(tmp_path / "bytes.csv")


def test_typed_rows_are_of_the_columns_and_types_that_were_asked_for(tmp_path):
    path = tmp_path / "table.csv"
    columns = {"name": str, "count": int, "share": float}
    assert read_typed(path, columns, "counts") == []
    rows = [{"name": "a", "count": 3, "share": 0.25}, {"name": "b", "count": 4, "share": ""}]
    write(path, rows, columns)
    assert read_typed(path, columns, "counts") == rows
    for wrong in ({"name": str, "count": int}, columns | {"count": lambda text: int(text + "x")}):
        with pytest.raises(GaitshiftError):
            read_typed(path, wrong, "counts")


@pytest.mark.parametrize("ending", ["csv", "parquet"])
def test_a_stream_gives_the_known_columns_as_numbers(ending, tmp_path):
    pyarrow = pytest.importorskip("pyarrow")
    columns = {"time": [0, 1.5, 3], "down": [True, False, True], "note": ["x", "y", "z"]}
    path = tmp_path / f"log.{ending}"
    if ending == "csv":
        rows = [dict(zip(columns, row, strict=True)) for row in zip(*columns.values(), strict=True)]
        write(path, rows)
    else:
        from pyarrow import parquet

        columns["time"] = [0.0, 1.5, 3.0]
        parquet.write_table(pyarrow.table(columns), path)
    (batch,) = stream(path, numbers=("time", "absent"), flags=("down",))
    assert set(batch) == {"time", "down"}
    np.testing.assert_array_equal(batch["time"], [0.0, 1.5, 3.0])
    np.testing.assert_array_equal(batch["down"], [1.0, 0.0, 1.0])


def test_a_markdown_table_has_a_head_a_rule_and_a_line_a_row():
    assert markdown(("a", "b"), [("1", "2"), ("3", "")]) == (
        "| a | b |\n| --- | --- |\n| 1 | 2 |\n| 3 |  |"
    )


@pytest.mark.parametrize(
    ("folder", "name", "study"),
    [
        ("transitions", "transitions.csv", transitions),
        ("transitions-all", "transitions.csv", transitions),
        ("study", "crossings.csv", crossing),
    ],
)
def test_a_study_makes_the_committed_tables_of_its_rows(folder, name, study):
    rows = read_typed(RESULTS / "shifting" / folder / name, study.COLUMNS, "rows")
    committed = (RESULTS / "shifting" / folder / "README.md").read_text()
    assert _tables(study.page(rows, "a command")) == _tables(committed)


def _tables(page: str) -> list[str]:
    return [line for line in page.splitlines() if line.startswith("|")]
