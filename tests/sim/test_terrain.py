"""The ground: against MuJoCo's own rays and contacts, closed forms, and the laws of noise."""

import dataclasses
import math

import mujoco
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gaitshift.errors import GaitshiftError
from gaitshift.sim.terrain import (
    KINDS,
    Section,
    Terrain,
    bank,
    flat,
    from_spec,
    pebbles,
    perlin,
    slope,
    spec_help,
    stairs,
    step,
    to_unit_interval,
    track,
)

AGREEMENT = 1e-6
"""How closely float32 samples must follow ours [m]."""


def random_field(rows=5, cols=7, seed=0):
    """Uncorrelated samples on unlike cells, so that neither axes nor diagonals can be swapped."""
    height = np.random.default_rng(seed).uniform(-0.4, 0.6, (rows, cols))
    return Terrain(height=height, size=(4.2, 1.6), origin=(-3.0, 0.7), name="random")


def points_over(terrain, count=300, seed=1):
    x0, x1, y0, y1 = terrain.extent
    return np.random.default_rng(seed).uniform((x0, y0), (x1, y1), (count, 2))


def model_of(terrain, bodies=""):
    field = to_unit_interval(terrain)
    rows, cols = field.data.shape
    size, position = (" ".join(map(repr, v)) for v in (field.size, field.position))
    model = mujoco.MjModel.from_xml_string(f"""
        <mujoco><asset><hfield name="ground" nrow="{rows}" ncol="{cols}" size="{size}"/></asset>
        <worldbody><geom type="hfield" hfield="ground" pos="{position}"/>{bodies}</worldbody>
        </mujoco>""")
    model.hfield_data[:] = field.data.reshape(-1)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    return model, data


def ray_heights(terrain, xy):
    model, data = model_of(terrain)
    top, down = float(terrain.height.max()) + 1.0, np.array([0.0, 0.0, -1.0])
    hit = np.zeros(1, np.int32)
    distance = [
        mujoco.mj_ray(model, data, np.array([x, y, top]), down, None, 1, -1, hit) for x, y in xy
    ]
    assert min(distance) >= 0.0
    return top - np.array(distance)


TERRAINS = {
    "random": random_field(),
    "one cell": random_field(rows=2, cols=2),
    "flat": flat(3.0, 2.0).moved(0.3, -0.2),
    "perlin": perlin(0.2, seed=3, length=5.05, width=3.0),
    "slope": slope(-20.0, length=6.0, width=2.0),
    "stairs": stairs(0.12, length=5.0, width=1.0),
    "pebbles": pebbles(0.04, seed=3, length=2.0, width=1.0, density=20.0).moved(-9.0, 4.0),
    "track": from_spec("slope:10@2,perlin:0.1@3,step:0.1@1", seed=0, length=1.0, width=2.0),
}


@pytest.mark.parametrize("name", TERRAINS)
def test_height_is_where_mujocos_rays_end(name):
    terrain = TERRAINS[name]
    xy = points_over(terrain)
    np.testing.assert_allclose(terrain.height_at(xy), ray_heights(terrain, xy), atol=AGREEMENT)


@pytest.mark.parametrize("ridge", [1.0, 0.0])
def test_contacts_see_the_same_diagonal_as_rays(ridge):
    """A ball let down on one saddle-shaped cell touches at the height and along the normal told."""
    saddle = np.array([[ridge, 1.0 - ridge], [1.0 - ridge, ridge]])
    terrain = Terrain(height=saddle, size=(2.0, 2.0), origin=(-1.0, -1.0), name="saddle")
    radius = 0.01
    ball = f'<body><freejoint/><geom type="sphere" size="{radius}"/></body>'
    model, data = model_of(terrain, ball)
    for xy in np.array([[0.3, -0.2], [-0.4, 0.1], [0.1, 0.6]]):
        shifts = np.array([[1e-4, 0.0], [-1e-4, 0.0], [0.0, 1e-4], [0.0, -1e-4]])
        east, west, north, south = terrain.height_at(xy + shifts)
        normal = np.array([west - east, south - north, 2e-4])
        normal /= np.linalg.norm(normal)
        touching = terrain.height_at(xy) + radius / normal[2]
        for gap, contacts in ((1e-3, 0), (-1e-3, 1)):
            data.qpos[:3] = *xy, touching + gap
            mujoco.mj_forward(model, data)
            assert data.ncon == contacts
        np.testing.assert_allclose(data.contact[0].frame[:3], normal, atol=1e-6)


def test_height_is_the_plane_through_the_three_samples_around_a_point():
    """A second implementation: search all triangles, solve for the plane of the one that fits."""
    terrain = random_field()
    rows, cols = terrain.height.shape
    dx, dy = terrain.cell
    corner = np.array(
        [
            [(terrain.origin[0] + j * dx, terrain.origin[1] + i * dy) for j in range(cols)]
            for i in range(rows)
        ]
    )

    def slow_height(point):
        for i in range(rows - 1):
            for j in range(cols - 1):
                for third in ((i, j + 1), (i + 1, j)):
                    nodes = [(i, j), third, (i + 1, j + 1)]
                    matrix = np.array([[*corner[node], 1.0] for node in nodes])
                    share = np.linalg.solve(matrix.T, [*point, 1.0])
                    if share.min() >= -1e-12:
                        return sum(s * terrain.height[n] for s, n in zip(share, nodes, strict=True))
        raise AssertionError("no triangle")

    xy = points_over(terrain, count=60)
    np.testing.assert_allclose(terrain.height_at(xy), [slow_height(p) for p in xy], atol=1e-12)


def test_samples_are_met_exactly_rows_along_y_and_columns_along_x():
    terrain = Terrain(
        height=np.array([[0.0, 1.0, 2.0], [10.0, 11.0, 12.0]]),
        size=(4.0, 5.0),
        origin=(1.0, -2.0),
        name="numbered",
    )
    assert terrain.cell == (2.0, 5.0)
    assert terrain.extent == (1.0, 5.0, -2.0, 3.0)
    x, y = np.meshgrid([1.0, 3.0, 5.0], [-2.0, 3.0])
    np.testing.assert_array_equal(terrain.height_at(np.stack([x, y], -1)), terrain.height)


def test_outside_the_field_the_nearest_border_counts():
    terrain = random_field()
    x0, x1, y0, y1 = terrain.extent
    outside = np.array(
        [[x0 - 5.0, y0 - 1.0], [x1 + 1.0, 1.1], [-1.0, y1 + 99.0], [np.inf, -np.inf]]
    )
    border = np.array([[x0, y0], [x1, 1.1], [-1.0, y1], [x1, y0]])
    np.testing.assert_allclose(terrain.height_at(outside), terrain.height_at(border), atol=1e-12)


def test_a_point_that_is_not_a_number_has_no_height_and_disturbs_no_other():
    terrain = random_field()
    xy = points_over(terrain, count=3)
    heights = terrain.height_at(xy)
    xy[1, 0] = np.nan
    assert np.isnan(terrain.height_at(xy)).tolist() == [False, True, False]
    np.testing.assert_array_equal(terrain.height_at(xy)[[0, 2]], heights[[0, 2]])
    assert not terrain.contains(xy)[1]


@pytest.mark.parametrize("batch", [(), (4,), (128, 4), (0,)])
def test_points_come_in_any_batch(batch):
    terrain = random_field()
    xy = np.random.default_rng(0).uniform(-3.0, 2.0, (*batch, 2))
    assert terrain.height_at(xy).shape == batch
    assert terrain.contains(xy).shape == batch


def test_contains_leaves_a_margin_on_all_four_sides():
    terrain = flat(4.0, 2.0)
    xy = np.array([[0.0, -1.0], [0.4, 0.0], [3.6, 0.0], [2.0, 0.6], [2.0, -0.6], [2.0, 0.4]])
    assert terrain.contains(xy).all()
    assert terrain.contains(xy, margin=0.5).tolist() == [False] * 5 + [True]
    assert not terrain.contains(np.array([[-0.1, 0.0], [4.1, 0.0], [1.0, 1.1], [1.0, -1.1]])).any()


def test_moved_ground_has_the_same_heights_elsewhere():
    terrain = from_spec("flat@2,perlin:0.1@3", seed=1, length=1.0, width=2.0)
    moved = terrain.moved(2.5, -1.0)
    xy = points_over(terrain)
    there = xy + np.array([2.5, -1.0])
    np.testing.assert_allclose(moved.height_at(there), terrain.height_at(xy), atol=1e-12)
    assert [(s.x0, s.x1) for s in moved.sections] == [(2.5, 4.5), (4.5, 7.5)]


def test_heights_are_an_own_and_read_only_copy():
    height = np.zeros((2, 3))
    terrain = Terrain(height=height, size=(1.0, 1.0), origin=(0.0, 0.0), name="copy")
    height[0, 0] = 5.0
    assert terrain.is_flat
    with pytest.raises(ValueError, match="read-only"):
        terrain.height[0, 0] = 5.0


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"height": np.array([[0.0, np.nan], [0.0, 0.0]])}, "finite"),
        ({"height": np.array([[0.0, np.inf], [0.0, 0.0]])}, "finite"),
        ({"height": np.zeros((1, 5))}, "2 × 2"),
        ({"size": (0.0, 1.0)}, "size must be above 0"),
        ({"size": (1.0, np.nan)}, "size must be above 0"),
        ({"origin": (np.inf, 0.0)}, "origin finite"),
    ],
)
def test_a_field_that_cannot_be_is_refused(change, message):
    good = {"height": np.zeros((2, 2)), "size": (1.0, 1.0), "origin": (0.0, 0.0), "name": "odd"}
    with pytest.raises(GaitshiftError, match=message) as error:
        Terrain(**(good | change))
    assert "'odd'" in str(error.value)


# As MuJoCo stores it


def test_unit_field_reaches_from_0_to_1():
    field = to_unit_interval(random_field())
    assert field.data.dtype == np.float32
    assert field.data.min() == 0.0
    assert field.data.max() == 1.0


def test_mujocos_compiler_leaves_the_samples_as_they_are():
    for terrain in (random_field(), flat(1.0, 1.0)):
        field = to_unit_interval(terrain)
        spec = mujoco.MjSpec()
        rows, cols = field.data.shape
        spec.add_hfield(
            name="ground",
            nrow=rows,
            ncol=cols,
            size=np.array(field.size),
            userdata=field.data.reshape(-1),
        )
        spec.worldbody.add_geom(
            type=mujoco.mjtGeom.mjGEOM_HFIELD, hfieldname="ground", pos=np.array(field.position)
        )
        model = spec.compile()
        np.testing.assert_array_equal(model.hfield_data, field.data.reshape(-1))


def test_tall_ground_still_agrees_with_mujoco():
    terrain = slope(45.0, length=30.0, width=1.0)
    xy = points_over(terrain)
    np.testing.assert_allclose(terrain.height_at(xy), ray_heights(terrain, xy), atol=AGREEMENT)


def test_the_base_lies_below_the_lowest_sample():
    field = to_unit_interval(random_field(), base=0.25)
    assert field.size[3] == 0.25
    assert field.position[2] == random_field().height.min()


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
