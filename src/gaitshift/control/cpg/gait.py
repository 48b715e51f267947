"""The gaits of the oscillators."""

from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class CpgGait:
    """A gait of oscillators; the phases of its touchdowns are those of the machine of its name."""

    name: str
    """Name of the gait and its machine."""
    frequency: float
    """Strides a second [Hz]."""
    duty: float
    """Share of a stride that each foot is down."""
    speed: float
    """Nominal forward speed [m/s]."""
    clearance: float = 0.07
    """Height of the swing [m]."""
    stance_x: float = 0.34
    """How far ahead of or behind the base origin feet stand in the middle of a stance [m]."""
    stance_y: float = 0.24
    """How far to the side [m]."""
    sweep: float = 1.0
    """Factor on the speed at which feet sweep back, to make up for slip."""


GAITS = {
    gait.name: gait
    for gait in (
        CpgGait(name="trot", frequency=2.2, duty=0.55, speed=0.6, clearance=0.09),
        CpgGait(name="pace", frequency=4.2, duty=0.5, speed=0.2, stance_y=0.15, sweep=3.0),
        CpgGait(name="bound", frequency=4.2, duty=0.5, speed=0.4, stance_x=0.25),
        CpgGait(name="walk", frequency=1.2, duty=0.75, speed=0.3, clearance=0.09),
    )
}
"""Gaits by name; numbers found by trials on flat ground. A body on the two feet of one side or one
end tips like a pendulum: only fast short steps near its middle keep it level."""
