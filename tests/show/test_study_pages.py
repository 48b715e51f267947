"""Pages of studies: their figures hold what was found, and tell it under the pointer."""

import csv
import json
import re
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from test_report import unpacked

import browsing
from gaitshift.cli import main
from gaitshift.show.report.figures import Axis
from marches import march, table

SHIFTS = Path(__file__).parents[2] / "docs" / "results" / "shifting" / "transitions"


def figures(path):
    """Data of the figures on a page, by name."""
    page = path.read_text()
    assert "http://" not in page
    assert "https://" not in page
    found = re.findall(r'<script type="application/json" id="(\w+)">(.*?)</script>', page)
    data = {name: json.loads(text) for name, text in found}
    assert set(re.findall("data-figure='(\\w+)'", page)) == set(data), "each has its place"
    return data


def rows_of(path):
    with path.open(newline="") as file:
        return list(csv.DictReader(file))


def told(figure, name):
    """One of the quantities that a map tells of its cells, as rows from the bottom up."""
    (said,) = [one for one in figure["says"] if one["name"] == name]
    values = unpacked(said["values"]) if isinstance(said["values"], dict) else said["values"]
    return np.reshape(np.asarray(values), (figure["y"]["count"], figure["x"]["count"]))


@pytest.fixture(scope="module")
def identified(tmp_path_factory):
    """An identification by logs that say steps of 4 cm are smooth, of 8 cm rough ground."""
    folder = tmp_path_factory.mktemp("identify")
    uneven = march("into", noise=0.02, robots=1, seed=3)
    uneven = replace(uneven, rough=np.zeros_like(uneven.rough))
    logs = [str(table(folder / "uneven.csv", uneven))]
    logs += [
        str(table(folder / f"walk{seed}.csv", march("into", noise=0.04, robots=1, seed=seed)))
        for seed in range(3)
    ]
    out = folder / "report"
    main(["identify", *logs, "--condition", "height_difference", "paper", "--out", str(out)])
    return out


@pytest.fixture(scope="module")
def shifted(tmp_path_factory):
    """Folder of a study of shifts: the committed one, whose rows are kept."""
    out = tmp_path_factory.mktemp("shifts") / "transitions"
    shutil.copytree(SHIFTS, out)
    switches = rows_of(out / "transitions.csv")[0]["switches"]
    main(["transitions", "--switches", switches, "--out", str(out)])
    assert (out / "transitions.csv").read_bytes() == (SHIFTS / "transitions.csv").read_bytes()
    return out


def test_a_map_says_of_the_chosen_cell_what_judging_said_of_the_chosen_numbers(identified):
    """The same logs chose and judged: two ways to the same figures."""
    data = figures(identified / "page.html")
    rows = rows_of(identified / "conditions.csv")
    assert [row["condition"] for row in rows] == ["height_difference", "paper"]
    for index, row in enumerate(rows):
        figure = data[f"map{index}"]
        i, j = figure["chosen"]
        assert float(figure["x"]["values"][i]) == float(row["beta"])
        assert float(figure["y"]["values"][j].split()[0]) == pytest.approx(
            float(row["alpha"]), rel=5e-3
        )
        assert told(figure, "detected")[j, i] == int(row["detected"])
        assert told(figure, "after")[j, i] == pytest.approx(float(row["delay_m"]))
        assert told(figure, "false shifts")[j, i] == int(row["false_shifts"])
        assert told(figure, "in")[j, i] == pytest.approx(float(row["km"]))
        assert "[counts]" in figure["x"]["name"]
        assert "[m]" in figure["y"]["name"]


def test_cells_without_a_shade_are_those_with_false_shifts_and_with_misses(identified):
    figure = figures(identified / "page.html")["map0"]
    kind = np.reshape(unpacked(figure["kind"]), (figure["y"]["count"], figure["x"]["count"]))
    wrong, detected = told(figure, "false shifts"), told(figure, "detected")
    assert set(np.unique(kind)) == {0, 1, 2}
    assert ((wrong > 0) == (kind == 1)).all()
    assert (2 * detected[kind == 0] > 3).all(), "most of the three robots"
    assert (2 * detected[kind == 2] <= 3).all()
    shade = np.reshape(unpacked(figure["values"]), kind.shape)
    assert np.isfinite(shade[kind == 0]).all()


def test_the_area_under_a_drawn_roc_curve_is_the_area_that_is_told(identified):
    """By trapezes, where the report counts pairs (Mann and Whitney)."""
    figure = figures(identified / "page.html")["roc0"]
    course = figure["title"].removeprefix("ROC curves on ")
    areas = {
        row["condition"]: float(row["area"])
        for row in rows_of(identified / "courses.csv")
        if row["course"] == course
    }
    assert {curve["name"] for curve in figure["series"]} == set(areas)
    for curve in figure["series"]:
        x, y = unpacked(curve["x"]), unpacked(curve["y"])
        assert np.trapezoid(y, x) == pytest.approx(areas[curve["name"]], abs=1e-6)
        assert f"{areas[curve['name']]:.3f}" in curve["label"]


def test_numbers_that_were_given_have_no_map(identified, tmp_path):
    log = str(identified.parent / "walk0.csv")
    given = ["--condition", "paper", "--alpha", "0.2", "--beta", "1000"]
    main(["identify", log, *given, "--out", str(tmp_path / "given")])
    assert set(figures(tmp_path / "given" / "page.html")) == {"roc0"}


def test_the_map_of_shifts_is_the_table_of_shifts(shifted):
    data = figures(shifted / "page.html")
    rows = rows_of(shifted / "transitions.csv")
    grounds = list(dict.fromkeys(row["ground"] for row in rows))
    assert len(data) == len(grounds)
    for figure, ground in zip(data.values(), grounds, strict=True):
        old, new = figure["y"]["values"], figure["x"]["values"]
        assert list(old) == list(reversed(new)), "from the top down as from left to right"
        succeeded, words = told(figure, "succeeded"), iter(figure["words"])
        words = {(o, n): next(words) for o in old for n in new}
        kind = np.reshape(unpacked(figure["kind"]), succeeded.shape)
        for row in (row for row in rows if row["ground"] == ground):
            pair = row["old"].capitalize(), row["new"].capitalize()
            cell = old.index(pair[0]), new.index(pair[1])
            assert succeeded[cell] == f"{row['successes']} of {row['switches']}"
            failed = int(row["switches"]) - int(row["successes"])
            assert words[pair] == str(failed)
            assert kind[cell] == (1 if failed == 0 else 0)
        assert (np.diagonal(kind[::-1]) == 2).all(), "no gait is swapped for itself"


def test_ticks_are_round_numbers_at_the_cells_nearest_to_them():
    numbers = np.array([0.0, 1.0, 2.0, 4.0, 5.1, 9.0, 20.0])
    axis = Axis.of_numbers("β [counts]", "β", numbers)
    assert [tick[:2] for tick in axis.ticks] == [
        *[(0, "0"), (1, "1"), (2, "2"), (4, "5"), (5, "10"), (6, "20")]
    ]
    assert axis.values == ("0", "1", "2", "4", "5.1", "9", "20")


@pytest.mark.slow
@browsing.needed
def test_the_pointer_reads_the_figures_without_a_network(identified, shifted, browser):
    opened, wrong = browsing.opened(browser, (shifted / "page.html").as_uri(), offline=True)
    canvas, note = (opened.locator(f"[data-figure] {part}").nth(1) for part in ("canvas", ".note"))
    canvas.scroll_into_view_if_needed()
    box = canvas.bounding_box()
    canvas.hover(position={"x": box["width"] * 0.9, "y": 30})  # the last column, the first row
    row = next(
        row
        for row in rows_of(shifted / "transitions.csv")
        if (row["old"], row["new"], row["ground"]) == ("trot", "bound", "perlin:0.10")
    )
    said = note.inner_text()
    assert said.startswith("from Trot · to Bound")
    assert f"succeeded {row['successes']} of {row['switches']}" in said
    assert browsing.keep(opened, "transitions").std() > 20
    assert not wrong

    opened, wrong = browsing.opened(browser, (identified / "page.html").as_uri(), offline=True)
    choice = rows_of(identified / "conditions.csv")[0]
    holder = opened.locator("details[open] [data-figure]").nth(1)
    note, canvas = holder.locator(".note"), holder.locator("canvas")
    assert f"β {float(choice['beta']):g} " in note.inner_text()
    assert note.inner_text().startswith("chosen")
    canvas.scroll_into_view_if_needed()
    canvas.hover(position={"x": 600, "y": 200})
    before = note.inner_text()
    assert before.startswith("α ")
    opened.mouse.wheel(0, -400)
    canvas.hover(position={"x": 75, "y": 200})
    opened.wait_for_function(
        "([e, from]) => e.textContent !== from", arg=[note.element_handle(), before]
    )
    zoomed = float(re.search(r"β ([\d.]+)", note.inner_text())[1])
    assert zoomed > 1, "the left border is no longer where β is least"
    canvas.dblclick(position={"x": 75, "y": 200})
    assert float(re.search(r"β ([\d.]+)", note.inner_text())[1]) == 0
    browsing.click(opened.locator("#theme"))
    assert opened.evaluate("getComputedStyle(document.documentElement).colorScheme") == "dark"
    assert browsing.keep(opened, "identify").std() > 20
    assert not wrong
