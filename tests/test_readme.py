"""The README: its code is run, it lists every command, and it is short."""

from pathlib import Path

import pytest

from gaitshift.cli import main
from pages import fences, items, rows

ROOT = Path(__file__).parents[1]
README, DESIGN = ROOT / "README.md", ROOT / "docs" / "design.md"

LONGEST = 1200
"""Words of the README."""


def test_the_readmes_code_runs_and_its_condition_counts_nothing_on_level_feet():
    (block,) = (text for kind, text in fences(README) if kind == "python")
    names = {}
    exec(block, names)
    assert names["state"].k.tolist() == [[0.0, 0.0]]
    assert names["decision"].fired.tolist() == [False]


def test_the_readme_is_short_and_its_one_table_leads_to_the_pages_that_answer():
    assert len(README.read_text(encoding="utf-8").split()) < LONGEST
    linked = [[token.attrGet("href") for token in row[0] if token.attrs] for row in rows(README)]
    assert len(linked) == 8
    assert all(len(links) == 1 and links[0].startswith("docs/results/") for links in linked)


@pytest.fixture
def commands(capsys):
    """The names of the subcommands, as the program lists them."""
    with pytest.raises(SystemExit):
        main(["--help"])
    listed = capsys.readouterr().out.split("{")[1].split("}")[0]
    return {name.strip() for name in listed.split(",")}


@pytest.mark.parametrize("page", [README, DESIGN], ids=lambda page: page.stem)
def test_a_page_that_lists_commands_lists_all_of_them_and_no_other(page, commands):
    heads = [cells[0] for cells in rows(page)] + items(page)
    codes = [head[0].content for head in heads if head and head[0].type == "code_inline"]
    listed = [code.split() for code in codes if code.startswith("gaitshift ")]
    assert {words[1] for words in listed} == commands
