"""How far touches lie from a plane: numpy's least squares, and grounds of known shape."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from gaitshift.shift import PlaneResidual, TouchdownSurprise
from gaitshift.shift.statistics.plane import deviation
from sensing import FEET, course, standing

quick = settings(max_examples=60, deadline=None)
ALL_DOWN = np.ones((1, 4), dtype=bool)
points = arrays(np.float64, (7, 3), elements=st.floats(-1.0, 1.0))


@quick
@given(points, st.integers(4, 7))
def test_deviation_is_that_of_numpys_least_squares(xyz, known):
    basis = np.column_stack([xyz[:known, :2], np.ones(known)])
    if np.linalg.svd(basis - basis.mean(axis=0))[1][1] < 0.05:
        return  # nearly in one line: many planes fit
    _, rest, _, _ = np.linalg.lstsq(basis, xyz[:known, 2], rcond=None)
    expected = math.sqrt(float(rest[0]) / (known - 3)) if rest.size else 0.0
    mask = np.arange(7)[None] < known
    assert deviation(xyz[None], mask)[0] == pytest.approx(expected, abs=1e-6)


def test_one_foot_of_four_on_a_rectangle_raised_by_h_is_h_half():
    """A plane leaves residuals of ± h/4 on all four: √(4 (h/4)² / 1) = h/2."""
    xyz = np.array([[[0.3, 0.2, 0.08], [0.3, -0.2, 0.0], [-0.3, 0.2, 0.0], [-0.3, -0.2, 0.0]]])
    assert deviation(xyz, ALL_DOWN)[0] == pytest.approx(0.04)


@quick
@given(points, st.floats(-0.5, 0.5), st.floats(-0.5, 0.5), st.floats(-3.0, 3.0))
def test_tilting_and_lifting_the_ground_changes_no_deviation(xyz, slope_x, slope_y, lift):
    tilted = xyz.copy()
    tilted[:, 2] += slope_x * xyz[:, 0] + slope_y * xyz[:, 1] + lift
    known = np.ones((1, 7), dtype=bool)
    if np.linalg.svd(xyz[:, :2] - xyz[:, :2].mean(axis=0))[1][1] < 0.05:
        return
    assert deviation(tilted[None], known) == pytest.approx(deviation(xyz[None], known), abs=1e-6)


def test_three_touches_tell_nothing():
    known = np.array([[True, True, True, False]])
    assert np.isnan(deviation(FEET[None], known))


@pytest.mark.parametrize(
    "statistic",
    [
        *(PlaneResidual(touches=touches) for touches in (1, 2, 4)),
        TouchdownSurprise(),
        TouchdownSurprise(touches=2, memory=12),
    ],
    ids=str,
)
def test_a_slope_is_not_roughness_and_waves_are(statistic):
    grounds = {
        "slope": lambda x, y: 0.25 * x - 0.1 * y,
        "waves": lambda x, y: 0.05 * math.sin(5 * x) * math.cos(7 * y),
    }
    worst = {name: np.nanmax(course(statistic, z)[100:]) for name, z in grounds.items()}
    assert worst["slope"] < 0.012, "what odometry is off by"
    if isinstance(statistic, TouchdownSurprise):
        assert worst["waves"] > 20.0 * worst["slope"], "changes of errors, in a body that is turned"
    else:
        assert worst["waves"] > 0.02, "a sine times a cosine of 5 cm has a deviation of 2.5 cm"


def test_a_foot_that_bounces_has_touched_once():
    statistic = PlaneResidual(touches=2)
    state = statistic.start(1)
    for contact in ([1, 1, 1, 1], [0, 1, 1, 1], [1, 1, 1, 1], *[[0, 1, 1, 1]] * 6, [1, 1, 1, 1]):
        sensed = replace(standing(), contact=np.array([contact], dtype=bool))
        state, _ = statistic.step(state, sensed)
        counts = (~np.isnan(state.touch[0, :, :, 0])).sum(axis=1).tolist()
    assert counts == [2, 1, 1, 1]


def test_a_foot_that_is_felt_in_its_swing_has_not_touched():
    """Felt for 30 ms in a swing at 2 m/s, and then for 30 ms where it stands."""
    for least, touches in ((0.0, 3), (0.02, 2)):
        statistic = PlaneResidual(touches=3, least_stance=least)
        state = statistic.start(1)
        moves = [0.0] * 10 + [0.02] * 25 + [0.0] * 10
        felt = [1] * 10 + [0] * 10 + [1] * 3 + [0] * 12 + [1] * 10
        place = 0.0
        for move, contact in zip(moves, felt, strict=True):
            place += move
            feet = FEET.copy()
            feet[0, 0] += place
            contacts = np.array([[contact, 1, 1, 1]], dtype=bool)
            state, _ = statistic.step(state, standing(feet=feet, contact=contacts))
        counts = (~np.isnan(state.touch[0, :, :, 0])).sum(axis=1).tolist()
        assert counts == [touches, 1, 1, 1]
