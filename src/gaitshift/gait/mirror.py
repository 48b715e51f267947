"""How a machine looks in a mirror that swaps left and right."""

from dataclasses import replace

from gaitshift.gait.edge import Edge
from gaitshift.gait.state import State


def mirrored_states(states: tuple[State, ...], edges: tuple[Edge, ...]) -> tuple[int, ...] | None:
    """State u in the mirror is state `result[u]`; None where the mirror shows another machine.

    Of a checked machine: every state is reached from the first and guards exclude each other, so
    the image of the first state settles those of all others.
    """
    names = [state.name for state in states]
    for image_of_first in names:
        images = _images(states[0].name, image_of_first, edges)
        if images is not None and _is_mirror(images, states, edges):
            return tuple(names.index(images[name]) for name in names)
    return None


def _images(first: str, image_of_first: str, edges: tuple[Edge, ...]) -> dict[str, str] | None:
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


def _is_mirror(images: dict[str, str], states: tuple[State, ...], edges: tuple[Edge, ...]) -> bool:
    carried = {
        replace(edge.mirrored(), source=images[edge.source], target=images[edge.target])
        for edge in edges
    }
    stances = {state.name: state.stance for state in states}
    return carried == set(edges) and all(
        state.mirrored().stance == stances[images[state.name]] for state in states
    )
