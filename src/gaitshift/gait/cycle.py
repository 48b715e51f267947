"""The cycle of a machine: the way from its first state back to it, and what the feet do on it."""

from math import ceil

from gaitshift.gait.edge import Edge
from gaitshift.gait.state import State
from gaitshift.robot.legs import LEGS


def cycle(states: tuple[State, ...], edges: tuple[Edge, ...]) -> tuple[int, ...]:
    """Numbers of the edges from the first state on, until a state comes again.

    Where a state has several ways out, the one that stands first in the file is the gait's; of a
    machine that ends instead of coming back, they are the edges until its end.
    """
    ways = {edge.source: number for number, edge in reversed(list(enumerate(edges)))}
    followed: list[int] = []
    name = states[0].name
    while name in ways and ways[name] not in followed:
        followed.append(ways[name])
        name = edges[ways[name]].target
    return tuple(followed)


def touchdowns(states: tuple[State, ...], edges: tuple[Edge, ...]) -> tuple[int, int, int, int]:
    """How often each foot comes down on one cycle when the stances are shown exactly."""
    stance = {state.name: state.stance for state in states}
    steps = [edges[number] for number in cycle(states, edges)]
    fl, fr, bl, br = (
        sum(leg in stance[e.target] and leg not in stance[e.source] for e in steps) for leg in LEGS
    )
    return fl, fr, bl, br


def shares(states: tuple[State, ...], edges: tuple[Edge, ...], dwell: int) -> tuple[float, ...]:
    """Dwell of each edge of the cycle over the machine's own dwell, 1 where that is 0."""
    return tuple(
        edges[number].guard.dwell / dwell if dwell else 1.0 for number in cycle(states, edges)
    )


def stride(shares_: tuple[float, ...], dwell: int) -> int:
    """Least control steps of a cycle at this dwell: each edge waits for its share, rounded up."""
    return sum(max(1, ceil(share * dwell - 1e-9)) for share in shares_)
