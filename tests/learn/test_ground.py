"""The grounds of training: drawn again alike, within their stage's measures."""

import numpy as np
import pytest

from gaitshift.learn.ground import draw_grounds
from gaitshift.learn.recipe import Recipe, Stage

ROUGH = Stage(name="rough", iterations=50, amplitude=0.15, slope=12.0, stair=0.06, step=0.1)


def measures(ground):
    """Largest |height|, steepest gradient [degrees] and highest edge [m] of a ground."""
    along_y, along_x = np.gradient(ground.height, *ground.cell[::-1])
    # On a plane the gradient is the same all over; on stairs it is an edge over a cell.
    gradient = np.degrees(np.arctan(np.hypot(along_x, along_y).max()))
    edge = np.abs(np.diff(ground.height, axis=1)).max()
    return np.abs(ground.height).max(), gradient, edge


def sorts(grounds):
    """Names of the kinds, told by the ground itself: level, a plane, steps along x, or noise."""
    told = []
    for ground in grounds:
        if np.ptp(ground.height) == 0:
            told.append("level")
            continue
        bent = np.abs(np.diff(ground.height, n=2, axis=1)).max() > 1e-9
        same_across = np.ptp(ground.height, axis=0).max() == 0
        told.append("noise" if bent and not same_across else "stairs" if bent else "plane")
    return told


def test_the_same_numbers_give_the_same_grounds_and_others_others():
    def drawn(within, seed):
        rough = (ground for ground in draw_grounds(ROUGH, within, seed) if not ground.is_flat)
        return [ground.height.tobytes() for ground in rough]

    assert drawn(5, 1) == drawn(5, 1)
    for other in (drawn(10, 1), drawn(5, 2)):
        assert all(one != another for one, another in zip(drawn(5, 1), other, strict=True))
    assert len(set(drawn(5, 1))) == 9, "and no two rough fields are alike"


def test_three_fields_stay_level_two_are_noise_and_the_others_a_slope_and_stairs():
    for within in (0, 20, 45):
        grounds = draw_grounds(ROUGH, within, 3)
        assert sorts(grounds) == ["level"] * 3 + ["noise"] * 2 + ["plane"] + ["stairs"] * 6
        assert len({ground.extent for ground in grounds}) == 1, "robots share one rectangle"


def test_the_last_stage_has_more_level_fields_and_fewer_edges():
    grounds = draw_grounds(Recipe().stages[-1], 20, 3)
    assert sorts(grounds) == ["level"] * 5 + ["noise"] * 2 + ["plane"] + ["stairs"] * 4


def test_slopes_rise_in_any_direction():
    angles = []
    for within in range(0, 50):
        for ground in draw_grounds(ROUGH, within, 0)[5:6]:
            along_y, along_x = np.gradient(ground.height, *ground.cell[::-1])
            angles.append(np.arctan2(along_y.mean(), along_x.mean()))
    quarters = np.bincount(np.floor(np.array(angles) / (np.pi / 2)).astype(int) + 2, minlength=4)
    assert quarters.min() >= 5, "of 50 slopes"


def test_no_ground_exceeds_what_its_stage_says_and_late_ones_come_near_it():
    found = np.array(
        [
            [measures(ground) for ground in draw_grounds(ROUGH, within, 0)]
            for within in range(0, 50, 2)
        ]
    )
    limits = {"noise": (slice(3, 5), 0, 0.15), "plane": (slice(5, 6), 1, 12.0)}
    limits |= {"stairs": (slice(6, 9), 2, 0.06), "steps": (slice(9, 12), 2, 0.1)}
    for name, (fields_, measure, limit) in limits.items():
        most = found[:, fields_, measure].max(axis=1)
        assert most.max() <= limit * (1 + 1e-9), name
        assert most[13:].max() > 0.8 * limit, name
        # The first fields reach 0.3 of it, and 0.3 + 0.7 · 4 / 25 after four iterations.
        assert most[:3].max() <= 0.412 * limit * (1 + 1e-9), name


@pytest.mark.parametrize(
    ("measure", "rough"),
    [("amplitude", [3, 4]), ("slope", [5]), ("stair", [6, 7, 8]), ("step", [9, 10, 11])],
)
def test_a_stage_of_one_kind_leaves_the_fields_of_the_others_level(measure, rough):
    stage = Stage(name="one", iterations=10, **{measure: 0.1})
    assert stage.is_rough
    grounds = draw_grounds(stage, 9, 0)
    assert [i for i, ground in enumerate(grounds) if not ground.is_flat] == rough


def test_a_stage_without_measures_is_level():
    stage = Stage(name="flat", iterations=5)
    assert not stage.is_rough
    (ground,) = draw_grounds(stage, 3, 0)
    assert ground.is_flat
