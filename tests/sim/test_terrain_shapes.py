"""Noise and shapes: closed forms, and the laws of noise."""

import math

import numpy as np
import pytest

from gaitshift.errors import GaitshiftError
from gaitshift.sim.terrain import (
    Section,
    bank,
    flat,
    from_spec,
    pebbles,
    perlin,
    slope,
    stairs,
    step,
)
from grounds import points_over

# Perlin noise


@pytest.mark.parametrize("amplitude", [0.0, 0.07, 0.1, 1.0])
@pytest.mark.parametrize("seed", range(3))
def test_largest_height_is_the_amplitude_itself(amplitude, seed):
    terrain = perlin(amplitude, seed=seed, length=7.3, width=4.1)
    assert np.abs(terrain.height).max() == amplitude


@pytest.mark.parametrize("octaves", [1, 3])
def test_noise_is_zero_on_the_lattice_of_its_wavelength(octaves):
    """With a lacunarity of 2 every finer lattice contains the coarsest one."""
    terrain = perlin(0.3, seed=0, length=9.0, width=6.0, octaves=octaves, cell=0.05)
    np.testing.assert_allclose(terrain.height[::30, ::30], 0.0, atol=1e-12)
    assert np.abs(terrain.height[::30, 15::30]).max() > 0.01


def test_waves_are_about_as_long_as_the_wavelength():
    """Power of one octave over the length of the wave vector: a band that ends near 1/wavelength.

    A sum of octaves fills the range only if each keeps to its own (Perlin, SIGGRAPH 1985).
    """
    terrain = perlin(1.0, seed=4, length=60.0, width=45.0, octaves=1, wavelength=3.0, cell=0.25)
    per_wavelength = [
        3.0 * np.fft.fftfreq(samples, cell)
        for samples, cell in zip(terrain.height.shape, terrain.cell[::-1], strict=True)
    ]
    frequency = np.hypot(per_wavelength[0][:, None], per_wavelength[1])
    power = np.abs(np.fft.fft2(terrain.height)) ** 2
    assert power[(frequency > 0.2) & (frequency < 1.5)].sum() > 0.95 * power.sum()
    assert 0.4 < (power * frequency).sum() / power.sum() < 1.0


def test_octaves_add_finer_noise_of_less_weight():
    def roughness(**change):
        terrain = perlin(0.1, seed=4, length=30.0, width=9.0, **change)
        return np.abs(np.diff(terrain.height, 2, axis=1)).mean()

    one, three, coarse = roughness(octaves=1), roughness(), roughness(gain=0.5)
    assert one < three < coarse
    assert roughness(gain=0.0) == one


def test_noise_knows_no_direction():
    """Over many seeds the mean is zero and slopes along x are as large as along y."""
    fields = [perlin(1.0, seed=s, length=12.0, width=12.0, octaves=1).height for s in range(12)]
    along_y, along_x = (np.sqrt(np.mean([np.diff(f, axis=a) ** 2 for f in fields])) for a in (0, 1))
    assert along_x == pytest.approx(along_y, rel=0.1)
    assert np.mean(fields) == pytest.approx(0.0, abs=0.02)


def test_a_finer_cell_samples_the_same_ground():
    coarse = perlin(0.1, seed=2, length=6.0, width=3.0, cell=0.1)
    fine = perlin(0.1, seed=2, length=6.0, width=3.0, cell=0.05)
    ratio = fine.height[::2, ::2].max() / coarse.height.max()
    np.testing.assert_allclose(fine.height[::2, ::2], ratio * coarse.height, atol=1e-12)


RANDOM = {
    "perlin": lambda seed: perlin(0.1, seed=seed, length=3.0, width=2.0),
    "pebbles": lambda seed: pebbles(0.1, seed=seed, length=3.0, width=2.0),
    "spec": lambda seed: from_spec("perlin:0.1@3,flat@1", seed=seed, length=1.0, width=2.0),
}


@pytest.mark.parametrize("make", RANDOM.values(), ids=RANDOM)
def test_same_seed_same_bits_and_another_seed_another_ground(make):
    assert make(5).height.tobytes() == make(5).height.tobytes()
    assert make(5).height.tobytes() != make(6).height.tobytes()


def test_a_generator_can_take_the_seeds_place():
    sizes = {"length": 3.0, "width": 2.0}
    np.testing.assert_array_equal(
        perlin(0.1, seed=np.random.default_rng(7), **sizes).height,
        perlin(0.1, seed=7, **sizes).height,
    )


# Shapes


@pytest.mark.parametrize("make", [perlin, pebbles])
def test_samples_span_the_size_exactly_at_most_a_cell_apart(make):
    terrain = make(0.1, seed=0, length=3.14, width=2.03, cell=0.04)
    assert terrain.size == (3.14, 2.03)
    assert terrain.extent == (0.0, 3.14, -1.015, 1.015)
    assert min(terrain.cell) > 0.038
    assert max(terrain.cell) <= 0.04
    assert terrain.height.shape == (52, 80)


@pytest.mark.parametrize("degrees", [15.0, 0.0, -10.0, 45.0])
def test_slope_rises_by_its_tangent(degrees):
    terrain = slope(degrees, length=5.0, width=2.0)
    xy = points_over(terrain)
    rise = xy[:, 0] * math.tan(math.radians(degrees))
    np.testing.assert_allclose(terrain.height_at(xy), rise, atol=1e-12)


@pytest.mark.parametrize("degrees", [12.0, -12.0])
@pytest.mark.parametrize("towards", [0.0, 30.0, 90.0, 180.0, 250.0])
def test_slope_towards_a_direction_rises_that_way_and_is_level_across_it(degrees, towards):
    terrain = slope(degrees, towards=towards, length=6.0, width=4.0)
    rise = math.tan(math.radians(degrees))
    c, s = math.cos(math.radians(towards)), math.sin(math.radians(towards))
    middle = np.array([[3.0, 0.0]])
    ahead, across = (0.7 * np.array([way]) for way in ((c, s), (-s, c)))
    here, there, aside = (terrain.height_at(middle + by) for by in (0 * ahead, ahead, across))
    assert there - here == pytest.approx(0.7 * rise)
    assert aside - here == pytest.approx(0.0, abs=1e-12)
    assert terrain.height_at(np.zeros((1, 2))) == pytest.approx(0.0, abs=1e-12)


def test_a_bank_rises_to_the_left_of_who_walks_along_it():
    terrain = bank(10.0, length=5.0, width=4.0)
    xy = points_over(terrain)
    rise = xy[:, 1] * math.tan(math.radians(10.0))
    np.testing.assert_allclose(terrain.height_at(xy), rise, atol=1e-12)
    assert terrain.name == "bank:10"
    assert terrain.sections == (Section(name="bank:10", x0=0.0, x1=5.0),)
    np.testing.assert_array_equal(bank(-10.0, length=5.0, width=4.0).height, -terrain.height)


def test_step_goes_up_once_in_the_middle_within_one_cell():
    terrain = step(0.05, length=4.0, width=2.0)
    middle = np.array([[1.974, 0.5], [2.001, 0.5], [0.0, -1.0], [4.0, 1.0]])
    np.testing.assert_allclose(terrain.height_at(middle), [0.0, 0.05, 0.0, 0.05], atol=1e-12)
    assert set(terrain.height.ravel()) == {0.0, 0.05}


def test_stairs_climb_a_flight_and_come_down_again():
    terrain = stairs(0.10, length=12.0, width=1.0)
    x = np.arange(0.15, 12.0, 0.3)
    heights = terrain.height_at(np.stack([x, np.zeros_like(x)], -1))
    # Metres of level ground: 1 at the start, 0.3 a tread, 12 - 2 - 2 * 9 * 0.3 = 4.6 on top.
    by_hand = [0.1 * min(10, max(0, math.floor((min(p, 12.0 - p) - 1.0) / 0.3) + 1)) for p in x]
    np.testing.assert_allclose(heights, by_hand, atol=1e-12)
    np.testing.assert_allclose(np.unique(terrain.height), np.arange(11) * 0.1, atol=1e-12)
    np.testing.assert_array_equal(terrain.height, terrain.height[:, ::-1])


@pytest.mark.parametrize(("length", "steps"), [(3.0, 1), (3.59, 1), (3.6, 2), (6.0, 6), (40.0, 10)])
def test_stairs_have_as_many_steps_as_leave_a_landing(length, steps):
    terrain = stairs(0.1, length=length, width=0.5)
    assert terrain.height.max() == pytest.approx(0.1 * steps)
    top = terrain.height[0] == terrain.height.max()
    assert top.sum() * terrain.cell[0] >= 1.0


def test_pebbles_lie_on_level_ground_and_the_highest_is_as_high_as_told():
    terrain = pebbles(0.03, seed=1, length=6.0, width=4.0)
    assert terrain.height.min() == 0.0
    assert terrain.height.max() == 0.03
    # Covered share of Poisson-strewn discs: 1 - exp(-density · mean area), d in [0.1, 0.2].
    mean_area = math.pi / 4 * (0.2**3 - 0.1**3) / (3 * 0.1)
    assert np.mean(terrain.height > 0.0) == pytest.approx(1 - math.exp(-4 * mean_area), rel=0.15)


@pytest.mark.parametrize("seed", range(5))
def test_one_pebble_is_a_round_bump_of_its_diameter(seed):
    terrain = pebbles(
        0.03, seed=seed, length=2.0, width=2.0, density=0.25, diameter=(0.3, 0.3), cell=0.01
    )
    rows, cols = np.nonzero(terrain.height)
    middle = np.array([(rows.min() + rows.max()) / 2, (cols.min() + cols.max()) / 2])
    away = np.linalg.norm(np.stack([rows, cols], -1) - middle, axis=-1) * 0.01
    assert away.max() == pytest.approx(0.15, abs=0.015)
    on_field = min(*middle, *(200 - middle)) * 0.01 > 0.16
    if on_field:
        assert (terrain.height > 0.0).sum() * 1e-4 == pytest.approx(math.pi * 0.15**2, rel=0.05)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda size: perlin(1.01, seed=0, **size), "amplitude must be 0 to 1 m, got 1.01"),
        (lambda size: perlin(math.nan, seed=0, **size), "amplitude must be"),
        (lambda size: perlin(0.1, seed=0, octaves=0, **size), "octaves must be 1 to 8, got 0"),
        (lambda size: perlin(0.1, seed=0, wavelength=0.3, **size), "cell must be at most 0.0375"),
        (lambda size: slope(46.0, **size), "angle must be -45 to 45 degrees"),
        (lambda size: bank(-45.1, **size), "angle must be -45 to 45 degrees"),
        (lambda size: stairs(-0.1, **size), "rise must be"),
        (lambda size: stairs(0.1, landing=1.5, **size), "length must be 4.5 m or more"),
        (lambda size: stairs(0.1, run=0.1, cell=0.06, **size), "half a tread"),
        (lambda size: step(2.0, **size), "height must be 0 to 1 m"),
        (lambda size: pebbles(0.1, seed=0, density=0.0, **size), "density must be"),
        (lambda size: pebbles(0.1, seed=0, diameter=(0.2, 0.1), **size), "smallest, largest"),
        (lambda size: pebbles(0.1, seed=0, cell=0.06, **size), "half of the smallest pebble"),
        (lambda size: flat(size["length"], math.inf), "width must be 0.5 to 1000 m, got inf"),
        (lambda size: flat(-1.0, 2.0), "length must be"),
        (lambda size: flat(4.0, 2.0, cell=0.0), "cell must be"),
        (lambda size: flat(1000.0, 1000.0), "give a larger cell"),
    ],
)
def test_makers_refuse_what_makes_no_ground(make, message):
    with pytest.raises(GaitshiftError, match=message):
        make({"length": 4.0, "width": 2.0})
