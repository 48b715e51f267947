"""The reward machine <U, u0, F, δu, δr> of a gait (paper III-B, III-C), for N robots at once."""

import re
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Int

from gaitshift.command import MOST_SPEED, PAPER_SPEED
from gaitshift.errors import GaitshiftError
from gaitshift.legs import LABEL_COUNT, LEGS, MIRRORED_LEGS, label_of
from gaitshift.reward_machine.check import check
from gaitshift.reward_machine.cycle import cycle, shares, stride, touchdowns
from gaitshift.reward_machine.edge import Edge, check_swing_height
from gaitshift.reward_machine.guard import check_dwell
from gaitshift.reward_machine.lookup import Lookup
from gaitshift.reward_machine.mirror import mirrored_states
from gaitshift.reward_machine.reading import Table, located
from gaitshift.reward_machine.state import State

_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_-]*")
_KEYS = (
    "name",
    "title",
    "description",
    "dwell",
    "dwell_range",
    "speed",
    "speed_range",
    "swing_height",
    "ideal_phase",
    "state",
    "transition",
)


class Step(NamedTuple):
    """What one step did to N machines."""

    state: Int[np.ndarray, " N"]
    """u', the state each machine is in now."""

    changed: Bool[np.ndarray, " N"]
    """Whether it came there by an edge in this step."""

    edge: Int[np.ndarray, " N"]
    """Number of that edge in `edges`, the number of all edges where there was none."""

    bonus: Float[np.ndarray, " N"]
    """Multiplier of the shared bonus: δr of the edge where changed, 0 elsewhere."""


@dataclass(frozen=True, kw_only=True)
class RewardMachine:
    """A gait as a machine whose states are stance sets and whose edges are steps of the feet.

    The laws in `check.py` hold for every instance; breaking one raises `GaitshiftError`. States
    count from 0 in the order of `states` (U and F together), and the first is u0. Where no guard
    holds the machine stays where it is.
    """

    name: str
    """Short name in files and on the command line: letters, digits, "_" and "-"."""

    title: str
    """Name for people, such as "Half-bound"."""

    description: str
    """One or two sentences for people."""

    states: tuple[State, ...]
    """U and F."""

    edges: tuple[Edge, ...]
    """δu and δr."""

    dwell: int
    """The machine's own dwell [control steps], of every edge that names no other."""

    ideal_phase: tuple[float, float, float, float]
    """Touchdown of each foot in `LEGS` [fraction of the stride, 0 to below 1]: the gait's norm."""

    dwell_range: tuple[int, int]
    """Least and greatest dwell that may be commanded [control steps]: the gait's frequencies."""

    speed: float
    """Forward speed at which the gait is at home [m/s]."""

    speed_range: tuple[float, float]
    """Least and greatest forward speed that may be commanded [m/s]."""

    def __post_init__(self):
        if not _NAME.fullmatch(self.name):
            raise GaitshiftError(
                f"name {self.name!r} must be letters, digits, '_' and '-', a letter first"
            )
        check_dwell(self.dwell)
        for leg, phase in zip(LEGS, self.ideal_phase, strict=True):
            if not 0 <= phase < 1:
                raise GaitshiftError(f"ideal_phase: {leg} must be 0 to below 1, not {phase:g}")
        for name, own in (("dwell", self.dwell), ("speed", self.speed)):
            low, high = getattr(self, f"{name}_range")
            if not 0 <= low <= own <= high:
                raise GaitshiftError(
                    f"{name}_range must be two numbers, rising, with {name} = {own:g} in between,"
                    f" not {low:g} to {high:g}"
                )
        if not self.speed_range[1] <= MOST_SPEED:
            raise GaitshiftError(f"speed_range must end at {MOST_SPEED:g} m/s or below")
        check_dwell(self.dwell_range[1])
        check(self.states, self.edges)

    @property
    def initial(self) -> int:
        """u0."""
        return 0

    @property
    def accepting(self) -> tuple[int, ...]:
        """F: the states in which a run ends; empty for a gait that goes on for ever."""
        return tuple(u for u, state in enumerate(self.states) if state.accepting)

    def step(
        self,
        state: Int[np.ndarray, " N"],
        contact: Bool[np.ndarray, "N 4"],
        steps_in_state: Int[np.ndarray, " N"],
        *,
        dwell: int | Int[np.ndarray, " N"] | None = None,
    ) -> Step:
        """δu and δr of N machines on the labels of this control step; nothing given is changed.

        Args:
            state: u, in which the policy acted.
            contact: whether each foot touches at the end of the step, the label L(s, a, s').
            steps_in_state: δ that the policy saw, the steps since the last change: 0 in the step
                that follows a change, and the step now ending counts. So an edge opens when
                steps_in_state + 1 reaches its dwell, and two changes are at least a dwell apart.
            dwell: a gait-frequency command [control steps], in place of the machine's own dwell;
                an edge that names its own keeps its proportion to it, rounded up.
        """
        rows = self._lookup
        suiting = rows.edge[state * LABEL_COUNT + label_of(contact)]
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

    def swing_share(
        self, edge: Int[np.ndarray, " N"], swing: Float[np.ndarray, "N 4"]
    ) -> Float[np.ndarray, " N"]:
        """How much of an edge's swing height its feet have reached, in [0, 1]: the lowest counts.

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
        """Feet that stand in the stance of the state left and not in that of the state entered."""
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

        Arguments are as in `step`. With the state it tells the policy what the lock-out is about:
        the stance is to be held now, or to be changed.
        """
        rows = self._lookup
        asked = self.dwell if dwell is None else dwell
        wanted = np.ceil(rows.least_share[state] * asked - 1e-9)
        return np.maximum(wanted - steps_in_state - 1, 0.0)

    def enter(self, contact: Bool[np.ndarray, "N 4"]) -> Int[np.ndarray, " N"]:
        """Return the state to start in: the stance that agrees with the contacts on most feet.

        Used at the start of an episode and after a switch of gaits, on which the paper is silent.
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
        """Share of the feet that are, down or up, as the stance of the present state has them.

        1 exactly where `shows_state` holds; 0 for an accepting state, which has no stance.
        """
        return self._lookup.agreement[state * LABEL_COUNT + label_of(contact)]

    @property
    def cycle(self) -> tuple[int, ...]:
        """The edges from the first state back to it, as numbers in `edges`."""
        return cycle(self.states, self.edges)

    @property
    def touchdowns(self) -> tuple[int, int, int, int]:
        """How often each foot comes down on one cycle when every stance is shown exactly."""
        return touchdowns(self.states, self.edges)

    def stride(self, dwell: int | None = None) -> int:
        """Least time of one cycle at a dwell, the machine's own if None [control steps]."""
        return stride(self._shares, self.dwell if dwell is None else dwell)

    def dwell_for(self, stride: Float[np.ndarray, " N"]) -> Int[np.ndarray, " N"]:
        """The dwell in `dwell_range` whose cycle comes nearest to `stride` [control steps]."""
        low, high = self.dwell_range
        strides = self._stride_of_dwell[low : high + 1]
        return low + np.abs(np.asarray(stride)[:, None] - strides).argmin(axis=1)

    def mirrored(self) -> "RewardMachine":
        """Return the machine of the robot seen in a mirror; feet in names of states change too."""
        phase = self.ideal_phase
        a, b, c, d = MIRRORED_LEGS
        return RewardMachine(
            name=self.name,
            title=self.title,
            description=self.description,
            states=tuple(state.mirrored() for state in self.states),
            edges=tuple(edge.mirrored() for edge in self.edges),
            dwell=self.dwell,
            dwell_range=self.dwell_range,
            speed=self.speed,
            speed_range=self.speed_range,
            ideal_phase=(phase[a], phase[b], phase[c], phase[d]),
        )

    def mirrored_states(self) -> tuple[int, ...] | None:
        """State u seen in a mirror is state `result[u]` of this same machine.

        None where the mirror shows another machine, as for a gait with a leading side.
        """
        return mirrored_states(self.states, self.edges)

    def to_dict(self) -> dict[str, object]:
        """Return the machine as plain data in the shape of a gait file, ready for JSON."""
        return {
            "name": self.name,
            "title": self.title,
            "description": self.description,
            "dwell": self.dwell,
            "dwell_range": list(self.dwell_range),
            "speed": self.speed,
            "speed_range": list(self.speed_range),
            "ideal_phase": dict(zip(LEGS, self.ideal_phase, strict=True)),
            "state": [state.to_dict() for state in self.states],
            "transition": [edge.to_dict() for edge in self.edges],
        }

    @classmethod
    def from_dict(cls, data: object) -> "RewardMachine":
        """Build the machine that `to_dict` or a gait file describes, checked in full.

        Raises `GaitshiftError` with one line that names the table and the key.
        """
        table = Table(data, keys=_KEYS)
        dwell = table.whole("dwell")
        check_dwell(dwell)
        swing_height = table.number("swing_height", default=0.0)
        check_swing_height(swing_height)
        speed = table.number("speed", default=PAPER_SPEED)
        dwell_range = table.pair("dwell_range", default=(dwell, dwell))
        if not all(end.is_integer() for end in dwell_range):
            raise GaitshiftError("dwell_range must be two whole numbers of control steps")
        with located("ideal_phase"):
            phases = Table(table.get("ideal_phase"), keys=LEGS)
            fl, fr, bl, br = (phases.number(leg) for leg in LEGS)
        return cls(
            name=table.text("name"),
            title=table.text("title"),
            description=table.text("description"),
            states=tuple(
                State.from_dict(one, number=number)
                for number, one in enumerate(table.tables("state"), start=1)
            ),
            edges=tuple(
                Edge.from_dict(one, number=number, dwell=dwell, swing_height=swing_height)
                for number, one in enumerate(table.tables("transition"), start=1)
            ),
            dwell=dwell,
            dwell_range=(int(dwell_range[0]), int(dwell_range[1])),
            speed=speed,
            speed_range=table.pair("speed_range", default=(speed, speed)),
            ideal_phase=(fl, fr, bl, br),
        )

    @cached_property
    def _shares(self) -> tuple[float, ...]:
        return shares(self.states, self.edges, self.dwell)

    @cached_property
    def _stride_of_dwell(self) -> Int[np.ndarray, " D"]:
        return np.array([stride(self._shares, dwell) for dwell in range(self.dwell_range[1] + 1)])

    @cached_property
    def _lookup(self) -> Lookup:
        return Lookup.of(self.states, self.edges, dwell=self.dwell)
