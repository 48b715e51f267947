"""How a machine looks in a mirror that swaps left and right."""

from gaitshift.reward_machine.edge import Edge
from gaitshift.reward_machine.state import State


def mirrored_states(states: tuple[State, ...], edges: tuple[Edge, ...]) -> tuple[int, ...] | None:
    """State u in the mirror is state `result[u]`; None where the mirror shows another machine.

    Of a checked machine: every state is reached from the first and guards exclude each other, so
    the image of the first state settles all others.
    """
    names = [state.name for state in states]
    for image in names:
        images = _images_from(states, edges, image)
        if images is not None and len(set(images.values())) == len(names):
            return tuple(names.index(images[name]) for name in names)
    return None


def _images_from(
    states: tuple[State, ...], edges: tuple[Edge, ...], image_of_first: str
) -> dict[str, str] | None:
    by_name = {state.name: state for state in states}
    images = {states[0].name: image_of_first}
    waiting = [states[0].name]
    while waiting:
        name = waiting.pop()
        one, other = by_name[name].mirrored(), by_name[images[name]]
        if (one.stance, one.accepting) != (other.stance, other.accepting):
            return None
        ways = {e.guard: e for e in edges if e.source == other.name}
        out = [e for e in edges if e.source == name]
        if len(out) != len(ways):
            return None
        for edge in out:
            twin = ways.get(edge.guard.mirrored())
            if twin is None or twin.bonus != edge.bonus:
                return None
            if edge.target not in images:
                images[edge.target] = twin.target
                waiting.append(edge.target)
            elif images[edge.target] != twin.target:
                return None
    return images
