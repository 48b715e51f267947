"""A deployment in real time over a link: at 100 Hz, and stopped softly whatever happens."""

from collections.abc import Callable

from gaitshift.control.deployment.link import Link
from gaitshift.control.deployment.loop import ControlStep, Deployment
from gaitshift.control.deployment.timing import Pace, Timing, uninterrupted
from gaitshift.errors import GaitshiftError
from gaitshift.robot.command import CONTROL_PERIOD


def run(
    deployment: Deployment,
    link: Link,
    *,
    seconds: float,
    wait: float,
    timing: Timing,
    see: Callable[[ControlStep], None] = lambda step: None,
) -> None:
    """Drives a robot over a link for this time [s] at 100 Hz, and stops it softly, always.

    `wait` is the longest time until its first sensors [s]. `timing` is filled in. `see` is called
    after each control step that is no stop.

    Raises:
        GaitshiftError: no sensors came, or none any more, or the robot stopped by itself.
    """
    with uninterrupted():
        _walk(deployment, link, seconds=seconds, wait=wait, timing=timing, see=see)
    if deployment.fault:
        raise GaitshiftError(deployment.fault)


def _walk(
    deployment: Deployment,
    link: Link,
    *,
    seconds: float,
    wait: float,
    timing: Timing,
    see: Callable[[ControlStep], None],
) -> None:
    pace = _begin(deployment, link, wait)
    steps = round(seconds / CONTROL_PERIOD)
    try:
        while steps > 0 and not deployment.fault:
            before = deployment.last
            _step(deployment, link, pace, timing)
            if deployment.last is not None and deployment.last is not before:
                see(deployment.last)
            steps -= 1
    finally:  # after Ctrl-C and after any error as well
        deployment.stop(link.now())
        while not deployment.is_over:
            _step(deployment, link, pace, timing)
        timing.round_trip = deployment.round_trips


def _begin(deployment: Deployment, link: Link, wait: float) -> Pace:
    """Waits for the first sensors.

    The first deadline is half a period after them, so that a little jitter on either side does not
    let a control step find two of them, or none.
    """
    end = link.now() + wait
    while deployment.inbox.newest is None:
        now = link.now()
        if now >= end:
            raise GaitshiftError(f"no valid sensors within {wait:g} s; is the robot on?")
        for data, arrived in link.receive(until=min(end, now + CONTROL_PERIOD)):
            deployment.receive(data, arrived)
    return Pace(deployment.inbox.arrived + CONTROL_PERIOD / 2)


def _step(deployment: Deployment, link: Link, pace: Pace, timing: Timing) -> None:
    """One control step at its deadline."""
    for data, arrived in link.receive(until=pace.deadline):
        deployment.receive(data, arrived)
    began = link.now()
    timing.jitter.append(began - pace.deadline)
    data = deployment.step(began)
    if data is not None:
        link.send(data)
    ended = link.now()
    timing.work.append(ended - began)
    timing.misses += pace.advance(ended)
