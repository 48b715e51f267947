"""The laws of every machine, checked before it is used.

1. Names of states are unique, and edges join states that exist.
2. A state has an outgoing edge, or it is accepting and has none. A machine of one state has no
   edge: its robot stands.
3. Every state is reached from the initial one.
4. Two guards of one source state never hold at once, so δu is a function.
5. A guard does not hold in the stance of its source, because otherwise a robot would leave the
   state by standing still; and one guard of the edges between two states holds in the stance of
   the target. So a state is the stance that was shown last.

Also the cycle of a machine, its touchdowns, and its mirror image.
"""

from dataclasses import replace
from itertools import combinations
from math import ceil

from gaitshift.data import known_names
from gaitshift.errors import GaitshiftError
from gaitshift.gait.elements import State, Transition, feet_text
from gaitshift.robot.legs import LEGS

MOST_STATES, MOST_EDGES = 64, 256
"""Most states and transitions of a machine; ours: the pairs of transitions are compared, and there
are 16 contact patterns."""


def check(states: tuple[State, ...], edges: tuple[Transition, ...]) -> None:
    """Raise a `GaitshiftError` naming the first law that is broken, and where."""
    for what, given, most in (("states", states, MOST_STATES), ("transitions", edges, MOST_EDGES)):
        if len(given) > most:
            raise GaitshiftError(f"{what} must be {most} or fewer, got {len(given)}")
    _check_names(states, edges)
    _check_ways_out(states, edges)
    _check_reached(states, edges)
    _check_one_at_a_time(edges)
    _check_stances({state.name: state for state in states}, edges)


def check_lockout(edges: tuple[Transition, ...], dwell: int, dwell_range: tuple[int, int]) -> None:
    """Refuse dwells that a commanded dwell, in place of the machine's own, cannot scale.

    A machine without a lock-out, in which all dwells are 0, is valid. Raises `GaitshiftError`.
    """
    if dwell > 0 and dwell_range[0] == 0:
        raise GaitshiftError(
            f"dwell_range must begin at 1 or more where dwell is above 0, got {dwell_range[0]} with"
            f" dwell {dwell}"
        )
    for number, edge in enumerate(edges, start=1):
        if dwell == 0 and edge.guard.dwell > 0:
            raise GaitshiftError(
                f"{_title(number, edge)}: dwell must be 0 where the machine's dwell is 0, got"
                f" {edge.guard.dwell}; give the machine a dwell of 1 or more"
            )


def _check_names(states: tuple[State, ...], edges: tuple[Transition, ...]) -> None:
    if not states:
        raise GaitshiftError("there must be at least one [[state]], got none")
    names = tuple(state.name for state in states)
    for number, name in enumerate(names, start=1):
        if name in names[: number - 1]:
            raise GaitshiftError(f"state {number}: names must differ, got {name!r} again")
    for number, edge in enumerate(edges, start=1):
        for name in (edge.source, edge.target):
            if name not in names:
                raise GaitshiftError(f"{_title(number, edge)}: {known_names('state', name, names)}")


def _check_ways_out(states: tuple[State, ...], edges: tuple[Transition, ...]) -> None:
    if states[0].accepting:
        raise GaitshiftError(f"state {states[0].name}: the first state must not be accepting")
    if len(states) == 1 and not edges:
        return  # a robot that stands
    left = {edge.source: _title(number, edge) for number, edge in enumerate(edges, start=1)}
    for state in states:
        if state.accepting and state.name in left:
            raise GaitshiftError(
                f"{left[state.name]}: a transition must not leave an accepting state"
            )
        if not state.accepting and state.name not in left:
            raise GaitshiftError(
                f"state {state.name} has no transition from it; add one or set accepting = true"
            )


def _check_reached(states: tuple[State, ...], edges: tuple[Transition, ...]) -> None:
    reached = {states[0].name}
    while new := {e.target for e in edges if e.source in reached} - reached:
        reached |= new
    if lost := [state.name for state in states if state.name not in reached]:
        raise GaitshiftError(
            f"state {lost[0]} cannot be reached from the first state, {states[0].name}"
        )


def _check_one_at_a_time(edges: tuple[Transition, ...]) -> None:
    for (i, one), (j, other) in combinations(enumerate(edges, start=1), 2):
        if one.source != other.source:
            continue
        feet = one.guard.pattern_shared_with(other.guard)
        if feet is not None:
            raise GaitshiftError(
                f"{_title(i, one)} and {_title(j, other)}: only one guard may hold at a time, both"
                f" hold with {feet_text(feet)} down"
            )


def _check_stances(states: dict[str, State], edges: tuple[Transition, ...]) -> None:
    shown = {
        (edge.source, edge.target)
        for edge in edges
        if edge.guard.holds_in(states[edge.target].stance) or states[edge.target].accepting
    }
    for number, edge in enumerate(edges, start=1):
        source, target = states[edge.source], states[edge.target]
        if edge.guard.holds_in(source.stance):
            raise GaitshiftError(
                f"{_title(number, edge)}: the guard must not hold in the stance of its source"
                f" {source.name} ({source.stance_text()})"
            )
        if (edge.source, edge.target) not in shown:
            raise GaitshiftError(
                f"{_title(number, edge)}: the guard must hold in the stance of its target"
                f" {target.name} ({target.stance_text()})"
            )


def _title(number: int, edge: Transition) -> str:
    return f"transition {number} ({edge.source} -> {edge.target})"


def cycle(states: tuple[State, ...], edges: tuple[Transition, ...]) -> tuple[int, ...]:
    """Numbers of the edges from the first state on, until a state repeats.

    Where a state has several outgoing edges, the first in the file that leads back to the first
    state is taken; where none does, the first. For a machine that ends in an accepting state, these
    are the edges until its end.
    """
    home = {states[0].name}
    while new := {edge.source for edge in edges if edge.target in home} - home:
        home |= new
    ranked = sorted(enumerate(edges), key=lambda numbered: numbered[1].target not in home)
    ways = {edge.source: number for number, edge in reversed(ranked)}
    followed: list[int] = []
    name = states[0].name
    while name in ways and ways[name] not in followed:
        followed.append(ways[name])
        name = edges[ways[name]].target
    return tuple(followed)


def touchdowns(
    states: tuple[State, ...], edges: tuple[Transition, ...]
) -> tuple[int, int, int, int]:
    """Touchdowns of each foot in one cycle in which the stances are shown exactly."""
    stance = {state.name: state.stance for state in states}
    steps = [edges[number] for number in cycle(states, edges)]
    fl, fr, bl, br = (
        sum(leg in stance[e.target] and leg not in stance[e.source] for e in steps) for leg in LEGS
    )
    return fl, fr, bl, br


def shares(
    states: tuple[State, ...], edges: tuple[Transition, ...], dwell: int
) -> tuple[float, ...]:
    """Dwell of each edge of the cycle over the machine's own dwell, 1 where that is 0.

    A machine without edges has a cycle of one dwell.
    """
    if not edges:
        return (1.0,)
    return tuple(
        edges[number].guard.dwell / dwell if dwell else 1.0 for number in cycle(states, edges)
    )


def stride(shares_: tuple[float, ...], dwell: int) -> int:
    """Least control steps of a cycle at this dwell: each edge waits for its share, rounded up."""
    return sum(max(1, ceil(share * dwell - 1e-9)) for share in shares_)


def mirrored_states(
    states: tuple[State, ...], edges: tuple[Transition, ...]
) -> tuple[int, ...] | None:
    """The mirror image of state u is state `result[u]`; None if the image is another machine.

    The machine must be checked: every state is reached from the first and guards exclude each
    other, so the image of the first state determines all others.
    """
    names = [state.name for state in states]
    for image_of_first in names:
        images = _images(states[0].name, image_of_first, edges)
        if images is not None and _is_mirror(images, states, edges):
            return tuple(names.index(images[name]) for name in names)
    return None


def _images(
    first: str, image_of_first: str, edges: tuple[Transition, ...]
) -> dict[str, str] | None:
    """Follow every edge and its mirror image side by side; None where there is no such edge."""
    targets = {(edge.source, edge.guard): edge.target for edge in edges}
    images, waiting = {first: image_of_first}, [first]
    while waiting:
        name = waiting.pop()
        for edge in (edge for edge in edges if edge.source == name):
            target = targets.get((images[name], edge.guard.mirrored()))
            if target is None:
                return None
            if edge.target not in images:
                images[edge.target] = target
                waiting.append(edge.target)
    return images


def _is_mirror(
    images: dict[str, str], states: tuple[State, ...], edges: tuple[Transition, ...]
) -> bool:
    carried = {
        replace(edge.mirrored(), source=images[edge.source], target=images[edge.target])
        for edge in edges
    }
    stances = {state.name: state.stance for state in states}
    return carried == set(edges) and all(
        state.mirrored().stance == stances[images[state.name]] for state in states
    )
