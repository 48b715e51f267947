"""Lines of figures in a file."""

from gaitshift import table
from gaitshift.learn.progress import last


def test_the_last_line_comes_back_as_it_was_written(tmp_path):
    lines = [
        {"iteration": 2, "stage": "flat", "speed": 1.0, "gait": "none", "clean": False},
        {"iteration": 4, "stage": "1", "speed": 2.5e-05, "gait": "trot", "clean": True},
        {"iteration": 6, "stage": "rough", "speed": None, "gait": "", "clean": True},
    ]
    for line in lines:
        table.append(tmp_path / "lines.csv", line)
    for iteration, line in ((3, 0), (4, 1), (5, 1), (9, 2)):
        found = last(tmp_path / "lines.csv", iteration)
        assert found == lines[line]
        assert list(map(type, found.values())) == list(map(type, lines[line].values()))
    assert last(tmp_path / "lines.csv", 1) == last(tmp_path / "none.csv", 9) == {}
