"""Tracks without jumps, and terrains written as text."""

import dataclasses
import math

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from gaitshift.errors import GaitshiftError
from gaitshift.sim.terrain import (
    KINDS,
    Section,
    bank,
    flat,
    from_spec,
    pebbles,
    perlin,
    slope,
    spec_help,
    stairs,
    step,
    track,
)

# Tracks


def test_track_has_no_jumps():
    """Fading by smoothstep s over a border b: |Δ(s h)| ≤ |Δh| + A · 1.875 · dx / b, then scaled."""
    noise = perlin(0.1, seed=1, length=6.0, width=3.0)
    ground = track([flat(2.0, 3.0), noise, flat(2.0, 3.0)], border=0.75)
    own = np.abs(np.diff(noise.height, axis=1)).max()
    bound = own + 0.1 * 1.875 * 0.1 / 0.75
    seams = np.diff(ground.height, axis=1)
    assert np.abs(seams).max() < 1.2 * bound
    assert np.abs(seams[:, [20, 79]]).max() < 0.002


def test_track_keeps_each_pieces_heights_beyond_the_borders():
    noise = perlin(0.1, seed=1, length=6.0, width=3.0)
    ground = track([flat(2.0, 3.0), noise, flat(2.0, 3.0)], border=0.75)
    inside = slice(8, -8)
    piece = ground.height[:, 20:81]
    scale = piece[5, 30] / noise.height[5, 30]
    np.testing.assert_allclose(piece[:, inside], scale * noise.height[:, inside], atol=1e-12)
    assert 1.0 <= scale < 1.3
    assert (ground.height[:, :21] == 0.0).all()
    assert (ground.height[:, 80:] == 0.0).all()


@pytest.mark.parametrize("seed", range(5))
def test_noise_in_a_track_still_reaches_its_amplitude_exactly(seed):
    ground = from_spec("flat@2,perlin:0.1@3,flat@2", seed=seed, length=1.0, width=2.0)
    assert np.abs(ground.height).max() == 0.1


def test_track_goes_on_from_the_height_where_a_piece_ended():
    ground = from_spec(
        "flat@2,slope:15@4,flat@2,step:0.1@2,slope:-15@4", seed=0, length=1.0, width=1.0
    )
    top = 4.0 * math.tan(math.radians(15.0))
    x = np.array([1.0, 3.0, 6.0, 7.9, 8.9, 9.1, 10.0, 12.0, 14.0])
    heights = ground.height_at(np.stack([x, np.full_like(x, 0.1)], -1))
    expected = [0.0, top / 4, top, top, top, top + 0.1, top + 0.1, top / 2 + 0.1, 0.1]
    np.testing.assert_allclose(heights, expected, atol=1e-9)


def test_rough_ground_on_a_hill_joins_at_the_hills_height():
    noise = perlin(0.1, seed=0, length=4.0, width=3.0)
    hill = slope(20.0, length=4.0, width=3.0)
    rough = dataclasses.replace(hill, height=hill.height + noise.height, name="rough", sections=())
    ground = track([rough, flat(2.0, 3.0)])
    end = hill.height[0, -1]
    assert ground.height[0, -1] == pytest.approx(end, abs=0.1)
    np.testing.assert_array_equal(ground.height[:, 40:], ground.height[0, -1])
    np.testing.assert_allclose(ground.height[:, :32], rough.height[:, :32], atol=1e-12)


def test_track_tells_its_sections():
    ground = from_spec("flat@8,perlin:0.10@12,flat@10", seed=0, length=1.0, width=2.0)
    assert ground.sections == (
        Section(name="flat", x0=0.0, x1=8.0),
        Section(name="perlin:0.1", x0=8.0, x1=20.0),
        Section(name="flat", x0=20.0, x1=30.0),
    )
    assert ground.name == "flat@8,perlin:0.1@12,flat@10"
    assert ground.size == (30.0, 2.0)
    assert flat(3.0, 2.0).sections == (Section(name="flat", x0=0.0, x1=3.0),)


def test_a_track_of_tracks_is_one_track():
    a, b, c = flat(2.0, 2.0), slope(5.0, length=3.0, width=2.0), flat(1.0, 2.0)
    nested, whole = (
        track([track([a, b]), c], origin=(1.0, 0.0)),
        track([a, b, c], origin=(1.0, 0.0)),
    )
    np.testing.assert_array_equal(nested.height, whole.height)
    assert nested.sections == whole.sections


def test_one_piece_is_a_track_and_stays_itself():
    noise = perlin(0.1, seed=0, length=4.0, width=3.0)
    np.testing.assert_array_equal(track([noise]).height, noise.height)


@pytest.mark.parametrize(
    "pieces",
    [
        [],
        [flat(2.0, 2.0), flat(2.0, 3.0)],
        [flat(2.0, 2.0), flat(2.0, 2.0, cell=0.05)],
        [flat(2.0, 2.0), flat(2.05, 2.0)],
    ],
)
def test_pieces_that_do_not_fit_are_refused(pieces):
    with pytest.raises(GaitshiftError, match=r"one piece|same width and cell"):
        track(pieces)


# Specs


SIZES = {"length": 4.0, "width": 2.0}
SPECS = {
    "flat": flat(4.0, 2.0),
    "perlin:0.10": perlin(0.10, seed=9, **SIZES),
    "slope:15": slope(15.0, **SIZES),
    "slope:-1e1": slope(-10.0, **SIZES),
    "bank:7": bank(7.0, **SIZES),
    "stairs:0.10": stairs(0.10, **SIZES),
    "step:0.05": step(0.05, **SIZES),
    " pebbles : 0.03 ": pebbles(0.03, seed=9, **SIZES),
}


@pytest.mark.parametrize("spec", SPECS)
def test_spec_gives_what_its_maker_gives(spec):
    terrain = from_spec(spec, seed=9, **SIZES)
    np.testing.assert_array_equal(terrain.height, SPECS[spec].height)
    assert (terrain.size, terrain.origin) == (SPECS[spec].size, SPECS[spec].origin)
    assert terrain.name == SPECS[spec].name


def test_every_kind_is_in_the_table_above_and_in_the_help():
    assert {spec.split(":")[0].strip() for spec in SPECS} == {kind.name for kind in KINDS}
    assert all(kind.usage in spec_help() for kind in KINDS)


def test_one_piece_may_say_its_own_length():
    assert from_spec("flat@7.5", seed=0, **SIZES).size == (7.5, 2.0)


def test_a_track_takes_the_finest_cell_of_its_pieces_unless_told():
    spec = "flat@2,step:0.05@2"
    assert from_spec(spec, seed=0, **SIZES).cell == pytest.approx((0.025, 0.025))
    assert from_spec(spec, seed=0, **SIZES, cell=0.05).cell == pytest.approx((0.05, 0.05))


def test_pieces_of_a_track_are_rounded_to_whole_cells():
    terrain = from_spec("flat@2.03,perlin:0.1@1.96", seed=0, **SIZES)
    assert [(s.x0, s.x1) for s in terrain.sections] == [(0.0, 2.0), (2.0, 4.0)]


def test_a_piece_of_a_track_keeps_its_noise_when_another_changes():
    a, b = (
        from_spec(f"perlin:0.1@{length},flat@1,perlin:0.1@2,flat@1", seed=3, **SIZES)
        for length in (2, 5)
    )
    np.testing.assert_allclose(a.height[:, 30:], b.height[:, 60:], atol=1e-12)


def test_two_noisy_pieces_of_a_track_differ():
    ground = from_spec("flat@1,perlin:0.1@2,flat@1,perlin:0.1@2,flat@1", seed=3, **SIZES)
    assert np.abs(ground.height[:, 10:31] - ground.height[:, 40:61]).max() > 0.01


@pytest.mark.parametrize(
    ("spec", "piece", "message"),
    [
        ("grass", "grass", "unknown terrain 'grass'"),
        ("", "", "unknown terrain ''"),
        ("flat@4,grass:2@3", "grass:2@3", "unknown terrain 'grass'"),
        ("perlin", "perlin", "amplitude is missing, must be 0 to 1 m"),
        ("perlin:", "perlin:", "amplitude must be 0 to 1 m, got ''"),
        ("perlin:a", "perlin:a", "got 'a'"),
        ("perlin:nan", "perlin:nan", "got nan"),
        ("flat@2,perlin:-0.1@2", "perlin:-0.1@2", "amplitude must be 0 to 1 m, got -0.1"),
        ("perlin:inf", "perlin:inf", "got inf"),
        ("slope:46", "slope:46", "angle must be -45 to 45 degrees, got 46"),
        ("stairs:0.1@2", "stairs:0.1@2", "length must be 3 m or more"),
        ("flat:1", "flat:1", "flat must have no number, got 1"),
        ("flat@2,flat", "flat", "must have a length, as in flat@8"),
        ("flat@0", "flat@0", "length must be 0.5 to 1000 m, got 0"),
        ("flat@-3,flat@2", "flat@-3", "length must be"),
        ("flat@nan", "flat@nan", "length must be"),
        ("flat@", "flat@", "length must be 0.5 to 1000 m, got ''"),
        ("perlin:0.1:3", "perlin:0.1:3", "a piece must be NAME"),
        ("flat@3@4", "flat@3@4", "a piece must be NAME"),
        ("flat@3,", "", "unknown terrain"),
        ("flat@900,flat@900", "flat@900,flat@900", "length must be 0.5 to 1000 m, got 1800"),
        ("flat@2,step:0.03@990", "flat@2,step:0.03@990", "give a larger cell"),
    ],
)
def test_a_wrong_spec_names_the_faulty_piece_and_what_would_be_right(spec, piece, message):
    with pytest.raises(GaitshiftError) as error:
        from_spec(spec, seed=0, length=4.0, width=3.0)
    line = str(error.value)
    assert line.startswith(f"terrain {piece!r}: ")
    assert message in line
    assert "perlin:AMPLITUDE [0 to 1 m]" in line
    assert "\n" not in line


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"seed": -1}, "seed must be 0 or larger"),
        ({"width": math.nan}, "width must be"),
        ({"cell": math.nan}, "cell must be"),
    ],
)
@pytest.mark.parametrize("spec", ["flat", "flat@1,flat@1"])
def test_wrong_sizes_and_seeds_are_refused(spec, change, message):
    with pytest.raises(GaitshiftError, match=message):
        from_spec(spec, **({"seed": 0, "length": 2.0, "width": 2.0} | change))


WORDS = st.sampled_from([kind.name for kind in KINDS])
NUMBERS = st.one_of(st.floats().map(repr), st.floats(0.0, 0.5).map(repr), st.text(max_size=4))
PIECES = st.builds(
    lambda word, colon, number, at, length: word + colon + number + at + length,
    st.one_of(WORDS, st.text(max_size=5)),
    st.sampled_from([":", ""]),
    NUMBERS,
    st.sampled_from(["@", ""]),
    st.one_of(st.integers(1, 5).map(str), NUMBERS),
)


@settings(max_examples=100, deadline=None)
@given(spec=st.one_of(st.text(max_size=20), st.lists(PIECES, max_size=3).map(",".join)))
@example(spec="flat:\x1e0")  # a sign that parts lines
@example(spec="\u2028@2")
def test_any_text_is_a_terrain_or_one_line_of_error(spec):
    try:
        terrain = from_spec(spec, seed=0, length=4.0, width=1.0, cell=0.05)
    except GaitshiftError as error:
        lines = str(error).splitlines()
    else:
        lines = [terrain.name]
    assert len(lines) == 1


@settings(max_examples=30, deadline=None)
@given(
    amplitude=st.floats(0.001, 1.0),
    degrees=st.floats(-45.0, 45.0),
    cells=st.lists(st.integers(40, 60), min_size=3, max_size=3),
)
def test_a_tracks_name_gives_the_same_track_again(amplitude, degrees, cells):
    a, b, c = (f"{n * 0.1:.1f}" for n in cells)
    spec = f"perlin:{amplitude!r}@{a},slope:{degrees!r}@{b},flat@{c}"
    terrain = from_spec(spec, seed=4, length=1.0, width=2.0)
    again = from_spec(terrain.name, seed=4, length=1.0, width=2.0)
    np.testing.assert_array_equal(again.height, terrain.height)
    assert again.sections == terrain.sections
    assert again.name == terrain.name
