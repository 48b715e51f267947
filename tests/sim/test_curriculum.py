"""What a training may ask for at one time."""

import pytest

from gaitshift.errors import GaitshiftError
from gaitshift.sim.env import Curriculum
from hopping import hop


@pytest.mark.parametrize("name", ["strictness", "command_scale", "penalty_scale", "mixed_starts"])
def test_shares_that_a_curriculum_asks_for_are_0_to_1(name):
    for share in (0.0, 0.5, 1.0):
        Curriculum(**{name: share})
    for share in (-0.1, 1.1):
        with pytest.raises(GaitshiftError) as error:
            Curriculum(**{name: share})
        assert str(error.value) == f"{name} must be 0 to 1, got {share}"


@pytest.mark.parametrize("name", ["swing_factor", "stance_factor"])
def test_a_curriculum_without_swings_or_stances_is_refused(name):
    with pytest.raises(GaitshiftError) as error:
        Curriculum(**{name: 0.0})
    assert str(error.value) == f"{name} must be above 0, got 0.0"


def test_an_environment_asks_for_everything_unless_told_otherwise():
    curriculum = hop(1).curriculum
    assert (curriculum.strictness, curriculum.command_scale, curriculum.penalty_scale) == (1, 1, 1)
    assert (curriculum.swing_factor, curriculum.stance_factor, curriculum.mixed_starts) == (1, 1, 0)
