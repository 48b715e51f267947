"""Height fields: against MuJoCo's own rays and contacts, and a second implementation."""

import mujoco
import numpy as np
import pytest

from gaitshift.errors import GaitshiftError
from gaitshift.sim.terrain import (
    Fields,
    Terrain,
    flat,
    from_spec,
    pebbles,
    perlin,
    slope,
    stairs,
    to_unit_interval,
)
from grounds import points_over

AGREEMENT = 1e-6
"""How closely float32 samples must follow ours [m]."""


def random_field(rows=5, cols=7, seed=0):
    """Uncorrelated samples on unlike cells, so that neither axes nor diagonals can be swapped."""
    height = np.random.default_rng(seed).uniform(-0.4, 0.6, (rows, cols))
    return Terrain(height=height, size=(4.2, 1.6), origin=(-3.0, 0.7), name="random")


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


UNLIKE = (random_field(), random_field(rows=2, cols=9, seed=1), flat(3.0, 2.0).moved(0.3, -0.2))


@pytest.mark.parametrize("fields", [UNLIKE, UNLIKE[2:], UNLIKE[:1]], ids=["three", "flat", "one"])
def test_each_robot_stands_on_its_own_field(fields):
    xy = np.random.default_rng(0).uniform(-4.0, 4.0, (7, 4, 2))
    xy[1, 2, 0], xy[2, 0, 1], xy[3, 3] = np.nan, np.inf, -np.inf
    there = Fields(fields, 7)
    alone = np.array([fields[i % len(fields)].height_at(points) for i, points in enumerate(xy)])
    np.testing.assert_array_equal(there.height_at(xy), alone)
    some = np.array([6, 1, 2])
    np.testing.assert_array_equal(there.height_at(xy[some], some), alone[some])


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
