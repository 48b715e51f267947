"""The documentation: every block of code and every command in it is run, and the site is built."""

import json
import runpy
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from gaitshift.cli import main
from pages import codes, fences, links, rows

ROOT = Path(__file__).parent.parent
PAGES = [ROOT / "docs" / "index.md", *sorted((ROOT / "docs" / "guide").glob("*.md"))]


def shortened(arguments):
    """The arguments of a training that ends after two iterations."""
    at = arguments.index("--iterations") if "--iterations" in arguments else len(arguments)
    return [*arguments[:at], "--iterations", "2", *arguments[at + 2 :]]


@pytest.mark.slow
@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_what_a_page_says_in_code_is_run_from_top_to_bottom(page, tmp_path, monkeypatch, capsys):
    """Files are written, code is executed, commands are run; a training ends after 2 iterations."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "examples").symlink_to(ROOT / "examples")  # pages are read in the repository
    names, ran = {}, 0
    for info, text in fences(page):
        kind, *settings = shlex.split(info) or [""]
        if settings:
            (title,) = (setting.removeprefix("title=") for setting in settings)
            (tmp_path / title).write_text(text, encoding="utf-8")
        elif kind == "python":
            exec(text, names)
        elif kind == "console":
            for line in text.splitlines():
                assert line.startswith("$ gaitshift "), line
                arguments = shlex.split(line)[2:]
                if arguments[0] == "train":
                    arguments = shortened(arguments)
                main(arguments)
        elif kind:
            pytest.fail(f"a block of {kind} is neither run nor written")
        ran += bool(kind)
    assert ran >= 3
    if page.stem == "own-controller":
        assert "bound" in capsys.readouterr().out.split()
    if page.stem == "tune":
        assert "shift at 1.7" in capsys.readouterr().out, "four of six pairs differ"


def test_every_page_of_the_documentation_is_in_the_sites_menu():
    menu = (ROOT / "mkdocs.yml").read_text(encoding="utf-8")
    pages = {path.relative_to(ROOT / "docs").as_posix() for path in (ROOT / "docs").rglob("*.md")}
    assert {page for page in pages if page not in menu} == set()


@pytest.mark.slow
def test_the_site_is_built_without_a_warning(tmp_path):
    if shutil.which("mkdocs", path=Path(sys.executable).parent) is None:
        pytest.skip("mkdocs is not installed")
    command = [sys.executable, "-m", "mkdocs", "build", "--strict", "--site-dir", str(tmp_path)]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr[-2000:]
    reference = (tmp_path / "reference.html").read_text(encoding="utf-8")
    for name in ("GaitGraph", "TouchdownSurprise", "RewardMachine", "LabelledRun", "GaitEnv"):
        assert f">{name}<" in reference or f'{name}"' in reference, name


def test_pages_on_shifting_are_made_by_the_commands_that_stand_on_them():
    path = ROOT / "tools" / "shifting_evidence.py"
    names = runpy.run_path(str(path))
    made = {page: ["identify", *arguments] for page, arguments in names["IDENTIFIED"].items()}
    for page, command in (made | names["STUDIED"]).items():
        stands = codes(ROOT / "docs" / "results" / "shifting" / page / "README.md")
        made_by = f"gaitshift {' '.join(command)} --out "
        assert any(code.startswith(made_by) for code in stands), page


@pytest.mark.parametrize(
    "page",
    [*ROOT.glob("*.md"), *sorted((ROOT / "docs").rglob("*.md"))],
    ids=lambda page: page.relative_to(ROOT).as_posix(),
)
def test_every_file_that_a_page_links_to_is_there(page):
    assert {link for link in links(page) if not (page.parent / link).exists()} == set()


def test_the_page_of_the_gaits_is_what_the_records_beside_the_policies_say():
    names = runpy.run_path(str(ROOT / "tools" / "gait_results.py"))
    assert names["PAGE"].read_text(encoding="utf-8") == names["page"]()


def test_the_page_of_stairs_and_steps_has_the_figures_of_the_records():
    names = runpy.run_path(str(ROOT / "tools" / "gait_results.py"))
    for cells in rows(ROOT / "docs" / "results" / "edges.md"):
        gait, *told = ("".join(token.content for token in cell) for cell in cells)
        record = json.loads((names["POLICIES"] / f"{gait.replace('-', '_')}.json").read_text())
        trials = {row["trial"]: row["value"] for row in record["evaluation"]["trials"]}
        measured = [
            trials[f"{figure} of 20 s, {ground}"]
            for ground in ("stairs:0.05", "step:0.10")
            for figure in ("survival", "distance_share")
        ]
        assert [float(text) for text in told] == pytest.approx(measured, abs=0.00051), gait
