"""How commands speak."""

import pytest

from gaitshift.cli.output import emit_table


@pytest.mark.parametrize("is_terminal", [False, True])
def test_no_cell_of_a_wide_table_is_cut(is_terminal, capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "60")
    monkeypatch.setattr("sys.stdout.isatty", lambda: is_terminal)
    cells = ("touchdown_surprise", *(f"{number} of 320 [m]" for number in range(100, 109)))
    emit_table("conditions", [cells])
    said = capsys.readouterr().out
    lines = [line for line in said.splitlines() if "│" in line]
    columns = zip(*(line.split("│")[1:-1] for line in lines), strict=True)
    told = ["".join(part.strip() for part in column) for column in columns]
    assert told == [cell if not is_terminal else cell.replace(" ", "") for cell in cells]
    assert (max(map(len, lines)) <= 60) == is_terminal
