"""The definition of a gait: states, edges, and nominal commands."""

import re
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TypeVar

import numpy as np
from jaxtyping import Float, Int

from gaitshift.data import Table, located
from gaitshift.errors import GaitshiftError
from gaitshift.gait.elements import State, Transition, check_dwell, check_swing_height
from gaitshift.gait.laws import (
    check,
    check_lockout,
    cycle,
    mirrored_states,
    shares,
    stride,
    touchdowns,
)
from gaitshift.robot.command import MOST_HEIGHT, MOST_SPEED, PAPER_SPEED
from gaitshift.robot.legs import LEGS, MIRRORED_LEGS

_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_-]*")
_KEYS = (
    "name",
    "title",
    "description",
    "dwell",
    "dwell_range",
    "speed",
    "speed_range",
    "lateral_speed",
    "height",
    "height_range",
    "swing_height",
    "ideal_phase",
    "state",
    "transition",
)


_Own = TypeVar("_Own", bound="Definition")  # Self, but for checkers of types at run time


@dataclass(frozen=True, kw_only=True)
class Definition:
    """A gait as data: <U, u0, F, δu, δr> (paper III-B) and the ranges of its commands.

    The laws in `laws.py` hold for every instance; breaking one raises `GaitshiftError`. States
    count from 0 in the order of `states` (U and F together), and the first is u0.
    """

    name: str
    """Short name in files and on the command line: letters, digits, "_" and "-"."""

    title: str
    """Name for people, such as "Half-bound"."""

    description: str
    """One or two sentences for people."""

    states: tuple[State, ...]
    """U and F."""

    edges: tuple[Transition, ...]
    """δu and δr."""

    dwell: int
    """The machine's own dwell [control steps], for every edge without its own; 0 where no edge has
    a dwell."""

    ideal_phase: tuple[float, float, float, float]
    """Ideal touchdown of each foot in `LEGS` [fraction of the stride, 0 to below 1]."""

    dwell_range: tuple[int, int]
    """Least and greatest dwell that may be commanded [control steps]: the gait's frequencies. The
    least is 0 where the machine's own is."""

    speed: float
    """Nominal forward speed [m/s], above 0."""

    speed_range: tuple[float, float]
    """Least and greatest forward speed that may be commanded [m/s]."""

    lateral_speed: float = 0.0
    """Greatest lateral speed that may be commanded, to either side [m/s]."""

    height: float = 0.0
    """Nominal height of the body, from that of the robot's stance [m]."""

    height_range: tuple[float, float] = (0.0, 0.0)
    """Least and greatest body height that may be commanded, from that of the robot's stance [m];
    both are `height` in a gait whose body height is not commanded."""

    def __post_init__(self):
        if not _NAME.fullmatch(self.name):
            raise GaitshiftError(
                f"name must be letters, digits, '_' and '-', a letter first, got {self.name!r}"
            )
        check_dwell(self.dwell)
        for leg, phase in zip(LEGS, self.ideal_phase, strict=True):
            if not 0 <= phase < 1:
                raise GaitshiftError(
                    f"ideal_phase: {leg} must be at least 0 and below 1, got {phase:g}"
                )
        for name, least in (("dwell", 0), ("speed", 0), ("height", -MOST_HEIGHT)):
            own, (low, high) = getattr(self, name), getattr(self, f"{name}_range")
            if not least <= low <= own <= high:
                raise GaitshiftError(
                    f"{name}_range must be two rising numbers with {name} = {own:g} between them,"
                    f" got {low:g} to {high:g}"
                )
        if self.speed == 0 and self.edges:
            raise GaitshiftError(f"speed must be above 0 m/s, got {self.speed:g}")
        if not 0 <= self.lateral_speed <= MOST_SPEED:
            raise GaitshiftError(
                f"lateral_speed must be 0 to {MOST_SPEED:g} m/s, got {self.lateral_speed:g}"
            )
        if not self.height_range[1] <= MOST_HEIGHT:
            raise GaitshiftError(
                f"height_range must end at {MOST_HEIGHT:g} m or below, got {self.height_range[1]:g}"
            )
        if not self.speed_range[1] <= MOST_SPEED:
            raise GaitshiftError(
                f"speed_range must end at {MOST_SPEED:g} m/s or below, got {self.speed_range[1]:g}"
            )
        check_dwell(self.dwell_range[1])
        check(self.states, self.edges)
        check_lockout(self.edges, self.dwell, self.dwell_range)

    @property
    def initial(self) -> int:
        """u0."""
        return 0

    @cached_property
    def accepting(self) -> tuple[int, ...]:
        """F: the states in which a run ends; empty for a gait without an end."""
        return tuple(u for u, state in enumerate(self.states) if state.accepting)

    @property
    def stands(self) -> bool:
        """Whether the robot stands: one state, which it never leaves."""
        return not self.edges

    @property
    def has_height(self) -> bool:
        """Whether a body height may be commanded."""
        return self.height_range[0] < self.height_range[1]

    @property
    def cycle(self) -> tuple[int, ...]:
        """The edges from the first state back to it, as numbers in `edges`."""
        return cycle(self.states, self.edges)

    @property
    def touchdowns(self) -> tuple[int, int, int, int]:
        """Touchdowns of each foot in one cycle in which every stance is shown exactly."""
        return touchdowns(self.states, self.edges)

    def stride(self, dwell: int | None = None) -> int:
        """Least time of one cycle at a dwell, by default the machine's own [control steps]."""
        return stride(self._shares, self.dwell if dwell is None else dwell)

    def dwell_for(self, stride: Float[np.ndarray, " N"]) -> Int[np.ndarray, " N"]:
        """The dwell in `dwell_range` whose cycle is nearest to `stride` [control steps]."""
        return self.dwell_range[0] + np.searchsorted(self._between_strides, stride)

    def mirrored(self: _Own) -> _Own:
        """Return the machine of the robot seen in a mirror; feet in names of states change too."""
        a, b, c, d = (self.ideal_phase[leg] for leg in MIRRORED_LEGS)
        return replace(
            self,
            states=tuple(state.mirrored() for state in self.states),
            edges=tuple(edge.mirrored() for edge in self.edges),
            ideal_phase=(a, b, c, d),
        )

    def mirrored_states(self) -> tuple[int, ...] | None:
        """The mirror image of state u is state `result[u]` of this machine.

        None where the mirror image is another machine, as for a gait with a leading side.
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
            "lateral_speed": self.lateral_speed,
            "height": self.height,
            "height_range": list(self.height_range),
            "ideal_phase": dict(zip(LEGS, self.ideal_phase, strict=True)),
            "state": [state.to_dict() for state in self.states],
            "transition": [edge.to_dict() for edge in self.edges],
        }

    @classmethod
    def from_dict(cls: type[_Own], data: object) -> _Own:
        """Build the machine that `to_dict` or a gait file describes, checked in full.

        Raises `GaitshiftError` with one line that names the table and the key.
        """
        table = Table(data, keys=_KEYS)
        dwell = table.whole("dwell")
        check_dwell(dwell)
        swing_height = table.number("swing_height", default=0.0)
        check_swing_height(swing_height)
        speed = table.number("speed", default=PAPER_SPEED)
        height = table.number("height", default=0.0)
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
                Transition.from_dict(one, number=number, dwell=dwell, swing_height=swing_height)
                for number, one in enumerate(
                    table.tables("transition") if table.has("transition") else [], start=1
                )
            ),
            dwell=dwell,
            dwell_range=(int(dwell_range[0]), int(dwell_range[1])),
            speed=speed,
            speed_range=table.pair("speed_range", default=(speed, speed)),
            lateral_speed=table.number("lateral_speed", default=0.0),
            height=height,
            height_range=table.pair("height_range", default=(height, height)),
            ideal_phase=(fl, fr, bl, br),
        )

    @cached_property
    def _shares(self) -> tuple[float, ...]:
        return shares(self.states, self.edges, self.dwell)

    @cached_property
    def _between_strides(self) -> Float[np.ndarray, " D"]:
        """The middles between the strides of neighbouring dwells of the range."""
        low, high = self.dwell_range
        strides = np.array([self.stride(dwell) for dwell in range(low, high + 1)])
        return (strides[1:] + strides[:-1]) / 2
