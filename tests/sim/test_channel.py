"""The channel of datagrams: its delay, order and losses."""

import numpy as np
import pytest

from gaitshift.errors import GaitshiftError
from gaitshift.sim.channel import Channel, ChannelConfig

N = 4000


def through(seed=0, **config):
    """Numbers and times of arrival of datagrams sent 10 ms apart, looked for each millisecond."""
    channel, got = Channel(ChannelConfig(**config), np.random.default_rng(seed)), []
    for step in range(10 * N + 300):
        now = step / 1000
        if step % 10 == 0 and step < 10 * N:
            channel.put((step // 10).to_bytes(4, "big"), now)
        got += [(int.from_bytes(data, "big"), due) for data, due in channel.take(now)]
    assert channel.next_due == np.inf
    numbers, times = zip(*got, strict=True)
    return np.array(numbers), np.array(times)


def test_a_perfect_channel_gives_everything_at_once():
    numbers, times = through()
    np.testing.assert_array_equal(numbers, np.arange(N))
    np.testing.assert_array_equal(times, np.arange(N) / 100)


def test_delay_and_jitter_are_those_asked_for_and_disorder_datagrams():
    numbers, times = through(delay=0.02, jitter=0.03)
    took = times - numbers / 100
    assert took.min() == pytest.approx(0.02, abs=1e-4)
    assert took.max() == pytest.approx(0.05, abs=1e-4)
    assert took.mean() == pytest.approx(0.035, abs=4 * 0.03 / np.sqrt(12 * N))
    assert (np.diff(numbers) < 0).any()
    assert (np.diff(times) >= 0).all()
    assert sorted(numbers) == list(range(N))


def test_the_share_that_is_lost_is_that_asked_for():
    numbers, _ = through(loss=0.3)
    assert 1 - len(numbers) / N == pytest.approx(0.3, abs=4 * np.sqrt(0.21 / N))


def test_the_same_seed_loses_the_same_ones_whatever_the_delay():
    first, _ = through(seed=3, loss=0.2)
    second, _ = through(seed=3, loss=0.2, delay=0.01, jitter=0.005)
    other, _ = through(seed=4, loss=0.2)
    np.testing.assert_array_equal(first, np.sort(second))
    assert set(first) != set(other)


@pytest.mark.parametrize(
    "config", [{"delay": -1.0}, {"jitter": 1.0}, {"loss": 1.0}, {"loss": np.nan}]
)
def test_what_no_channel_has_is_refused(config):
    with pytest.raises(GaitshiftError, match=next(iter(config))):
        ChannelConfig(**config)
