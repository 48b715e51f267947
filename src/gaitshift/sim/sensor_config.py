"""How good the sensors and the link of a robot are, and presets by name.

White noise of a density d per √Hz has the standard deviation d √(1/2T) in the mean over a control
step T: d · √50 Hz. Data sheets hold for a unit at rest. Walking shakes it, so that the noise of our
presets is larger.
"""

import math
from dataclasses import dataclass, replace

from gaitshift.data import check_ranges, known_names
from gaitshift.errors import GaitshiftError
from gaitshift.robot.command import CONTROL_PERIOD
from gaitshift.robot.state import CONTACT_FORCE

MOST_DELAY = 0.1
"""Longest delay and jitter [s]; ours: ten control steps, and far below the shortest stride of a
shipped gait, 0.28 s. A command that is a stride late belongs to another step."""


@dataclass(frozen=True, kw_only=True)
class SensorConfig:
    """Errors of the sensors of a robot, and of the link to its joints. The default has none.

    Standard deviations and probabilities are for the samples of control steps, 10 ms apart.
    """

    name: str = "own"
    """Of the preset, for tables."""
    encoder_noise: float = 0.0
    """Standard deviation of joint angles, white [rad]."""
    encoder_step: float = 0.0
    """Joint angles are rounded to multiples of this [rad]; 0: not rounded."""
    joint_velocity_noise: float = 0.0
    """Standard deviation of joint velocities, white [rad/s]."""
    gyro_noise: float = 0.0
    """Standard deviation of angular velocities, white, on each axis [rad/s]."""
    gyro_bias: float = 0.0
    """Standard deviation of their bias at the start, on each axis [rad/s]."""
    gyro_bias_walk: float = 0.0
    """Random walk of that bias: its standard deviation after 1 s [rad/s/√s]."""
    accelerometer_noise: float = 0.0
    """Standard deviation of specific forces, white, on each axis [m/s²]."""
    accelerometer_bias: float = 0.0
    """Standard deviation of their bias, constant from the start, on each axis [m/s²]."""
    attitude_time: float = math.inf
    """Time constant of the attitude filter, after which the accelerometer outweighs the gyro [s];
    infinity: the gyro alone."""
    contact_threshold: float = CONTACT_FORCE
    """A foot is felt when its normal force exceeds this [N]."""
    contact_missed: float = 0.0
    """Share of the steps with a foot on the ground in which it is not felt."""
    contact_false: float = 0.0
    """Share of the steps with a foot in the air in which it is felt."""
    contact_error_time: float = CONTROL_PERIOD
    """Mean duration of what causes such errors [s]."""
    measures_velocity: bool = True
    """Whether the true velocity of the base is given, which no robot measures."""
    delay: tuple[float, float] = (0.0, 0.0)
    """Range of the time from a measurement until joints follow the target that it leads to [s];
    each robot has its own, uniform in the range, from its start on."""
    jitter: float = 0.0
    """The delay of each target differs from it by up to ± this, uniformly [s]."""
    loss: float = 0.0
    """Share of the targets that do not arrive; joints then keep the last one."""

    def __post_init__(self) -> None:
        check_ranges(
            self,
            encoder_noise=(0.0, 1.0),
            encoder_step=(0.0, 1.0),
            joint_velocity_noise=(0.0, 100.0),
            gyro_noise=(0.0, 10.0),
            gyro_bias=(0.0, 10.0),
            gyro_bias_walk=(0.0, 10.0),
            accelerometer_noise=(0.0, 100.0),
            accelerometer_bias=(0.0, 10.0),
            attitude_time=(0.1, math.inf),
            contact_threshold=(0.0, 10_000.0),
            contact_missed=(0.0, 0.5),
            contact_false=(0.0, 0.5),
            contact_error_time=(CONTROL_PERIOD, 10.0),
            loss=(0.0, 0.9),
        )
        if not 0 <= self.jitter <= MOST_DELAY:
            raise GaitshiftError(f"jitter must be 0 to {MOST_DELAY:g} s, got {self.jitter:g}")
        least, most = self.delay
        if not 0 <= least <= most <= MOST_DELAY:
            raise GaitshiftError(
                f"delay must be a range within 0 to {MOST_DELAY:g} s, got {least:g} to {most:g}"
            )

    @property
    def is_perfect(self) -> bool:
        """Whether everything is measured as it is; targets may still be late."""
        arriving = replace(self, name="own", delay=(0.0, 0.0), jitter=0.0, loss=0.0)
        return arriving == SensorConfig()

    @property
    def is_immediate(self) -> bool:
        """Whether every target arrives at once."""
        return self.delay == (0.0, 0.0) and self.jitter == 0.0 and self.loss == 0.0


def sensor_preset(name: str) -> SensorConfig:
    """The preset of this name.

    Raises:
        GaitshiftError: there is none.
    """
    for preset in PRESETS:
        if preset.name == name:
            return preset
    raise GaitshiftError(known_names("sensor preset", name, tuple(p.name for p in PRESETS)))


_DEGREE = math.pi / 180

PERFECT = SensorConfig(name="perfect")
"""Everything is measured as it is, the velocity of the base as well, and targets are not late."""

ANYMAL = SensorConfig(
    name="anymal",
    # Ours: 0.5 mm at the foot, for play and for links that bend under load.
    encoder_noise=1e-3,
    # 17 bit a turn, the coarse end of 17 to 19 bit for absolute encoders in joint drives.
    encoder_step=2 * math.pi / 2**17,
    # Ours: six times what two readings of such an encoder 2.5 ms apart give.
    joint_velocity_noise=0.05,
    # Ours: six times 0.007 °/s/√Hz (Xsens MTi-1 series, data sheet), for vibrations of the trunk.
    gyro_noise=5e-3,
    # 1° a minute, typical for heading by gyros alone (Xsens MTi user manual MT0605P, 4.3).
    gyro_bias=_DEGREE / 60,
    # Ours: 10 °/h (in-run bias stability, Xsens MTi-1 series) within 100 s.
    gyro_bias_walk=5e-6,
    # Ours: six times 120 µg/√Hz (Xsens MTi-1 series), for vibrations of the trunk.
    accelerometer_noise=0.05,
    # 0.2° of static roll and pitch (Xsens MTi user manual MT0605P, 4.3) times g.
    accelerometer_bias=0.034,
    # Ours: the vertical then has an error of 0.6° to 0.7° RMS in a trot; Xsens states 0.5° each for
    # roll and pitch (MTi-20 in motion, MT0605P, 4.3), and PX4's filter has 5 s (ATT_W_ACC 0.2).
    attitude_time=4.0,
    # Ours, for force sensors in the feet: 3 % of the weight, and one step of a hundred wrong.
    contact_threshold=10.0,
    contact_missed=0.01,
    contact_false=0.005,
    contact_error_time=0.02,
    measures_velocity=False,
    # Ours: one to three cycles of a bus at 400 Hz.
    delay=(0.0025, 0.0075),
    jitter=0.001,
    loss=0.001,
)
"""A robot like ANYmal: encoders at the joints, an inertial unit of the class of Xsens MTi, force
sensors in the feet, a real-time bus."""

CHEAP = SensorConfig(
    name="cheap",
    # As legged_gym, whose noise is uniform within ± 0.01 rad.
    encoder_noise=0.0058,
    # 14 bit a turn, as magnetic encoders such as AS5047 have.
    encoder_step=2 * math.pi / 2**14,
    # Ours: a third of legged_gym, ± 1.5 rad/s, which is meant as more than any robot has.
    joint_velocity_noise=0.3,
    # Ours: ten times 0.015 °/s/√Hz (TDK ICM-20948, DS-000189); legged_gym has ± 0.2 rad/s.
    gyro_noise=0.02,
    # Ours: 0.3 °/s are left of ± 5 °/s (ICM-20948) when the mean at rest is taken off.
    gyro_bias=0.3 * _DEGREE,
    # Ours: 0.06 °/s within 100 s, as the unit warms up.
    gyro_bias_walk=1e-4,
    # Ours: twelve times 230 µg/√Hz (ICM-20948).
    accelerometer_noise=0.2,
    # Ours: 10 mg are left of ± 50 mg on a board (ICM-20948) after calibration: 0.6° of tilt.
    accelerometer_bias=0.1,
    # Ours: shorter than above, because the gyro drifts more; 1.1° to 1.2° RMS in a trot.
    attitude_time=2.0,
    # Ours, for contacts by motor currents: 7 % of the weight, and twice to four times the errors of
    # Bledt et al. 2018, whose fusion with the gait's phase is right in 99.3 % of all steps.
    contact_threshold=20.0,
    contact_missed=0.03,
    contact_false=0.015,
    contact_error_time=0.03,
    measures_velocity=False,
    # Ours: half to two control steps; Walk These Ways trains for up to 30 ms (lag_timesteps).
    delay=(0.005, 0.02),
    jitter=0.0025,
    # Ours: radio or a shared bus without real time.
    loss=0.01,
)
"""A robot for a few thousand euros: magnetic encoders, a consumer inertial unit such as ICM-20948
or BMI270, contacts by motor currents, a computer without real time."""

PRESETS = (PERFECT, ANYMAL, CHEAP)
