"""What the README says in code is run."""

import re
from pathlib import Path

README = Path(__file__).parent.parent / "README.md"


def test_the_readmes_code_runs_and_its_condition_counts_nothing_on_level_feet():
    (block,) = re.findall(r"```python\n(.*?)```", README.read_text(encoding="utf-8"), re.DOTALL)
    names = {}
    exec(block, names)
    assert names["state"].k.tolist() == [0.0]
    assert names["fire"].tolist() == [False]
