"""The reward machine <U, u0, F, δu, δr> of a gait (paper III-B, III-C), for N robots at once."""

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Int

from gaitshift.data import located, tables_in
from gaitshift.gait.definition import Definition
from gaitshift.gait.lookup import Lookup
from gaitshift.robot.legs import LABEL_COUNT, label_of

GRACE = 2
"""Control steps by which a change may be late without loss: ours, the delay of contacts."""

LATEST = 0.5
"""A change later than `GRACE` by this share of the dwell earns no bonus; ours."""


class Step(NamedTuple):
    """Result of one step of N machines."""

    state: Int[np.ndarray, " N"]
    """u', the new state of each machine."""

    changed: Bool[np.ndarray, " N"]
    """Whether it took an edge in this step."""

    edge: Int[np.ndarray, " N"]
    """Number of that edge in `edges`, the number of all edges where there was none."""

    bonus: Float[np.ndarray, " N"]
    """Multiplier of the shared bonus: δr of the edge where changed, 0 elsewhere."""


@dataclass(frozen=True, kw_only=True)
class RewardMachine(Definition):
    """A gait as a machine whose states are stance sets and whose edges are changes of contacts.

    If no guard holds, the state does not change.
    """

    def step(
        self,
        state: Int[np.ndarray, " N"],
        contact: Bool[np.ndarray, "N 4"],
        steps_in_state: Int[np.ndarray, " N"],
        *,
        dwell: int | Int[np.ndarray, " N"] | None = None,
    ) -> Step:
        """δu and δr of N machines on the labels of this control step; arguments are not changed.

        Args:
            state: u, in which the policy acted.
            contact: whether each foot touches at the end of the step, the label L(s, a, s').
            steps_in_state: δ that the policy saw, the steps since the last change: 0 in the step
                after a change. The step that ends now counts, so an edge opens when
                steps_in_state + 1 reaches its dwell, and two changes are at least a dwell apart.
            dwell: a stride-frequency command [control steps], in place of the machine's own dwell;
                an edge with its own dwell keeps its proportion, rounded up.
        """
        rows = self._lookup
        suiting = self.suiting(state, contact)
        waited = steps_in_state + 1
        if dwell is None:
            waited_enough = waited >= rows.dwell[suiting]
        else:
            waited_enough = waited * rows.dwell_parts >= rows.dwell_share[suiting] * dwell
        edge = np.where(waited_enough, suiting, len(self.edges))
        changed = edge < len(self.edges)
        return Step(
            state=np.where(changed, rows.target[edge], state),
            changed=changed,
            edge=edge,
            bonus=rows.bonus[edge],
        )

    def suiting(
        self, state: Int[np.ndarray, " N"], contact: Bool[np.ndarray, "N 4"]
    ) -> Int[np.ndarray, " N"]:
        """The edge out of each state whose guard holds for these contacts, whatever its dwell.

        Numbered as `Step.edge`: the number of all edges where none holds.
        """
        return self._lookup.edge[state * LABEL_COUNT + label_of(contact)]

    def swing_share(
        self, edge: Int[np.ndarray, " N"], swing: Float[np.ndarray, "N 4"]
    ) -> Float[np.ndarray, " N"]:
        """Share of an edge's swing height that its lowest foot reached, in [0, 1].

        Args:
            edge: as `step` gives it; 1 where there was none.
            swing: greatest clearance [m] of each foot since the machine lifted it.
        """
        rows = self._lookup
        height = rows.swing_height[edge]
        share = np.clip(swing / np.where(height > 0, height, 1.0)[:, None], 0.0, 1.0)
        return np.where(rows.landing[edge], share, 1.0).min(axis=1)

    def lifted(
        self, left: Int[np.ndarray, " N"], entered: Int[np.ndarray, " N"]
    ) -> Bool[np.ndarray, "N 4"]:
        """Feet that are in the stance of the old state and not in that of the new one."""
        stance = self._lookup.down
        return stance[left] & ~stance[entered]

    def expected(self, state: Int[np.ndarray, " N"]) -> Bool[np.ndarray, "N 4"]:
        """Feet whose touchdown is in place: those in the stance of the state or of the next one."""
        return self._lookup.expected[state]

    def wait(
        self,
        state: Int[np.ndarray, " N"],
        steps_in_state: Int[np.ndarray, " N"],
        dwell: int | Int[np.ndarray, " N"] | None = None,
    ) -> Float[np.ndarray, " N"]:
        """Control steps until the first edge out of the state may open; 0 once it may.

        Arguments are as in `step`. With the state it shows the policy whether the lock-out requires
        it to hold the stance, or it may change the stance.
        """
        return np.maximum(self._least_steps(state, dwell) - steps_in_state - 1, 0.0)

    def punctuality(
        self,
        state: Int[np.ndarray, " N"],
        steps_in_state: Int[np.ndarray, " N"],
        dwell: int | Int[np.ndarray, " N"] | None = None,
    ) -> Float[np.ndarray, " N"]:
        """Punctuality of a change in this step, a factor on its bonus in [0, 1]. Ours.

        1 until `GRACE` steps after the first edge out of the state may open, 0 when it is later
        than that by `LATEST` of the dwell, and linear in between. It is 1 without a dwell, and in a
        machine with an accepting state, which has no stride. The lock-out prevents strides above
        the commanded frequency; this factor penalises strides below it, and unequal half-strides.
        Arguments are as in `step`.
        """
        if self.accepting:
            return np.ones(len(state))
        wanted = self._least_steps(state, dwell)
        late = np.maximum(steps_in_state + 1 - wanted - GRACE, 0.0)
        share = np.maximum(1.0 - late / (LATEST * np.maximum(wanted, 1.0)), 0.0)
        return np.where(wanted > 0, share, 1.0)

    def _least_steps(
        self, state: Int[np.ndarray, " N"], dwell: int | Int[np.ndarray, " N"] | None
    ) -> Float[np.ndarray, " N"]:
        """Steps after which the first edge out of the state may open."""
        asked = self.dwell if dwell is None else dwell
        return np.ceil(self._lookup.least_share[state] * asked - 1e-9)

    def enter(self, contact: Bool[np.ndarray, "N 4"]) -> Int[np.ndarray, " N"]:
        """Return the first state: the one whose stance agrees with the contacts on most feet.

        Used at the start of an episode and after a gait shift, for which the paper gives no rule.
        Ties go to the lowest state; an accepting state is never entered.
        """
        return self._lookup.fitting_state[label_of(contact)]

    def shows_stance(self, contact: Bool[np.ndarray, "N 4"]) -> Bool[np.ndarray, " N"]:
        """Whether the contacts are the stance of any state."""
        return self._lookup.is_stance[label_of(contact)]

    def shows_state(
        self, state: Int[np.ndarray, " N"], contact: Bool[np.ndarray, "N 4"]
    ) -> Bool[np.ndarray, " N"]:
        """Whether the contacts are the stance of the present state."""
        return label_of(contact) == self._lookup.stance[state]

    def agreement(
        self, state: Int[np.ndarray, " N"], contact: Bool[np.ndarray, "N 4"]
    ) -> Float[np.ndarray, " N"]:
        """Share of the feet whose contact agrees with the stance of the present state.

        1 exactly where `shows_state` holds; 0 for an accepting state, which has no stance.
        """
        return self._lookup.agreement[state * LABEL_COUNT + label_of(contact)]

    @cached_property
    def _lookup(self) -> Lookup:
        return Lookup.of(self.states, self.edges, dwell=self.dwell)


def read_toml(path: Path) -> RewardMachine:
    """Read the machine in a TOML file, checked in full.

    Raises `GaitshiftError` with one line that begins with the file's path. It names the line of a
    TOML error, or the table of an error in the machine.
    """
    with located(str(path)):
        return RewardMachine.from_dict(tables_in(path))
