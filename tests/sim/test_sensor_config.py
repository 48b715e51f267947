"""Descriptions of sensors: what is allowed, and the presets."""

import math

import numpy as np
import pytest

from gaitshift.errors import GaitshiftError
from gaitshift.gait import gaits
from gaitshift.sim.sensor_config import MOST_DELAY, PRESETS, SensorConfig, sensor_preset


@pytest.mark.parametrize(
    ("values", "says"),
    [
        ({"encoder_noise": -0.01}, "encoder_noise must be 0 to 1, got -0.01"),
        ({"encoder_step": math.nan}, "encoder_step must be 0 to 1, got nan"),
        ({"joint_velocity_noise": -1.0}, "joint_velocity_noise must be 0 to 100, got -1.0"),
        ({"gyro_noise": -1e-9}, "gyro_noise must be 0 to 10, got -1e-09"),
        ({"gyro_bias_walk": math.inf}, "gyro_bias_walk must be 0 to 10, got inf"),
        ({"accelerometer_noise": -0.1}, "accelerometer_noise must be 0 to 100, got -0.1"),
        ({"attitude_time": 0.0}, "attitude_time must be 0.1 to inf, got 0.0"),
        ({"contact_threshold": -1.0}, "contact_threshold must be 0 to 10000, got -1.0"),
        ({"contact_missed": 0.6}, "contact_missed must be 0 to 0.5, got 0.6"),
        ({"contact_error_time": 0.001}, "contact_error_time must be 0.01 to 10, got 0.001"),
        ({"delay": (-0.01, 0.02)}, "delay must be a range within 0 to 0.1 s, got -0.01 to 0.02"),
        ({"delay": (0.02, 0.01)}, "delay must be a range within 0 to 0.1 s, got 0.02 to 0.01"),
        ({"delay": (0.0, 0.4)}, "delay must be a range within 0 to 0.1 s, got 0 to 0.4"),
        ({"delay": (0.0, math.nan)}, "delay must be a range within 0 to 0.1 s, got 0 to nan"),
        ({"jitter": -0.01}, "jitter must be 0 to 0.1 s, got -0.01"),
        ({"loss": 1.0}, "loss must be 0 to 0.9, got 1.0"),
    ],
)
def test_impossible_sensors_are_one_line(values, says):
    with pytest.raises(GaitshiftError) as error:
        SensorConfig(**values)
    assert str(error.value) == says


def test_an_unknown_preset_is_one_line_that_lists_the_presets():
    with pytest.raises(GaitshiftError) as error:
        sensor_preset("anymol")
    (line,) = str(error.value).splitlines()
    assert all(name in line for name in ("'anymol'", "perfect", "anymal", "cheap"))


def test_presets_have_their_names_and_only_the_perfect_one_measures_velocity():
    assert [preset.name for preset in PRESETS] == ["perfect", "anymal", "cheap"]
    for preset in PRESETS:
        assert sensor_preset(preset.name) is preset
        assert preset.is_perfect == preset.is_immediate == (preset.name == "perfect")
        assert preset.measures_velocity == (preset.name == "perfect")


def test_every_error_of_the_cheap_preset_is_larger():
    """But for that of time: its filter trusts the gyro for less long."""
    _, anymal, cheap = PRESETS
    for name, value in vars(cheap).items():
        if name in ("name", "measures_velocity"):
            continue
        if name == "attitude_time":
            assert value < anymal.attitude_time
        else:
            assert np.greater(value, getattr(anymal, name)).all(), name


def test_late_targets_alone_leave_the_sensors_perfect():
    late = SensorConfig(delay=(0.01, 0.02), jitter=0.001, loss=0.1)
    assert late.is_perfect
    assert not late.is_immediate
    assert not SensorConfig(contact_threshold=5.0).is_perfect
    assert SensorConfig(contact_threshold=5.0).is_immediate


def test_the_longest_delay_is_far_below_the_shortest_stride():
    """Of every gait, at its highest stride frequency: the least dwells of its states together."""
    for name in gaits.names():
        machine = gaits.load(name)
        assert machine.stride(machine.dwell_range[0]) > 2 * MOST_DELAY, name
