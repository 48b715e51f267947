"""A machine as arrays, so that N robots step by array indexing without loops."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int

from gaitshift.gait.elements import State, Transition, feet_label
from gaitshift.robot.legs import LABEL_COUNT, LEGS, contact_of


@dataclass(frozen=True, kw_only=True, eq=False)
class Lookup:
    """δu and δr as arrays: `edge` is the edge of a state and label, rows hold data of edges.

    The rows have one entry more than there are edges: the last, at index -1 and `edges`, means
    that no guard holds.
    """

    edge: Int[np.ndarray, " states_x_16"]
    """Transition for state u and label l, at index 16 u + l."""

    target: Int[np.ndarray, " rows"]
    """State the edge leads to."""

    dwell: Int[np.ndarray, " rows"]
    """Dwell of the edge [control steps]."""

    dwell_share: Int[np.ndarray, " rows"]
    """Numerator of the dwell of the edge over the machine's own dwell."""

    dwell_parts: int
    """Common denominator of `dwell_share`."""

    least_share: Float[np.ndarray, " states"]
    """Shortest dwell of the edges out of each state over the machine's own; 0 where none is."""

    swing_height: Float[np.ndarray, " rows"]
    """Height that the landing feet should reach in their swing [m]."""

    landing: Bool[np.ndarray, "rows 4"]
    """Feet whose swing ends with the edge: down in its guard, not in the stance of its source. No
    foot where the edge has no swing height."""

    bonus: Float[np.ndarray, " rows"]
    """Multiplier of the shared bonus; 0 in the last row."""

    stance: Int[np.ndarray, " states"]
    """Contact label of each state's stance, -1 for an accepting state."""

    down: Bool[np.ndarray, "states 4"]
    """Feet down in each state's stance; none for an accepting state."""

    expected: Bool[np.ndarray, "states 4"]
    """Feet down in the stance of each state or of a next state."""

    is_stance: Bool[np.ndarray, " 16"]
    """Whether a contact label is the stance of any state."""

    agreement: Float[np.ndarray, " states_x_16"]
    """Share of the feet in which label l agrees with the stance of state u, at index 16 u + l."""

    fitting_state: Int[np.ndarray, " 16"]
    """State whose stance agrees with a label on most feet, the lowest where several do."""

    @classmethod
    def of(
        cls, states: tuple[State, ...], edges: tuple[Transition, ...], *, dwell: int
    ) -> "Lookup":
        """Build the arrays of a checked machine whose own dwell is `dwell` [control steps]."""
        index = {state.name: u for u, state in enumerate(states)}
        suits = np.full((len(states), LABEL_COUNT), len(edges))
        for e, edge in enumerate(edges):
            suits[index[edge.source], list(edge.guard.labels)] = e
        dwells = np.array([edge.guard.dwell for edge in edges] + [0])
        stands = {state.name: state.stance for state in states}
        landing = [
            [edge.swing_height > 0 and leg in edge.guard.down - stands[edge.source] for leg in LEGS]
            for edge in edges
        ]
        down = np.array([[leg in state.stance for leg in LEGS] for state in states])
        expected = down.copy()
        for edge in edges:
            expected[index[edge.source]] |= down[index[edge.target]]
        stance = np.array([-1 if s.accepting else feet_label(s.stance) for s in states])
        return cls(
            edge=suits.ravel(),
            target=np.array([index[edge.target] for edge in edges] + [0]),
            dwell=dwells,
            dwell_share=dwells if dwell else np.ones_like(dwells),
            dwell_parts=dwell or 1,
            least_share=np.array(
                [
                    min((e.guard.dwell for e in edges if e.source == s.name), default=0)
                    / (dwell or 1)
                    for s in states
                ]
            ),
            swing_height=np.array([edge.swing_height for edge in edges] + [0.0]),
            landing=np.array([*landing, [False] * len(LEGS)]),
            bonus=np.array([edge.bonus for edge in edges] + [0.0]),
            stance=stance,
            down=down,
            expected=expected,
            is_stance=np.isin(np.arange(LABEL_COUNT), stance),
            agreement=_agreement(stance).ravel(),
            fitting_state=_agreement(stance).argmax(axis=0),
        )


def _agreement(stance: Int[np.ndarray, " states"]) -> Float[np.ndarray, "states 16"]:
    contact = contact_of(np.arange(LABEL_COUNT))
    share = (contact == contact_of(stance)[:, None]).mean(axis=-1)
    return np.where(stance[:, None] < 0, 0.0, share)
