"""Motors against the straight lines of a DC motor, its circuit, and a rotor that spins up."""

import re
from dataclasses import replace

import mujoco
import numpy as np
import pytest

from gaitshift.errors import GaitshiftError
from gaitshift.robot.description import ANYMAL_B, Gains
from gaitshift.robot.motor import Motor

MOTOR = Motor(torque_limit=30.0, no_load_speed=20.0, stall_torque=60.0)

# Speed [rad/s], least and greatest torque [N·m], by ruler on the plot of the two lines.
ENVELOPE = [
    (-30.0, 30.0, 30.0),
    (-25.0, 15.0, 30.0),
    (-20.0, 0.0, 30.0),
    (-15.0, -15.0, 30.0),
    (-10.0, -30.0, 30.0),
    (0.0, -30.0, 30.0),
    (10.0, -30.0, 30.0),
    (14.0, -30.0, 18.0),
    (20.0, -30.0, 0.0),
    (24.0, -30.0, -12.0),
    (30.0, -30.0, -30.0),
]


def wheel(motor, *, inertia=0.5, kp=40.0, kd=1.5, step=1e-3):
    """A wheel on a hinge without gravity, driven by a motor."""
    spec = mujoco.MjSpec()
    spec.option.timestep, spec.option.gravity = step, (0.0, 0.0, 0.0)
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    body = spec.worldbody.add_body(mass=1.0, inertia=(inertia, 1.0, 1.0), explicitinertial=True)
    body.add_joint(
        name="hinge", axis=(1.0, 0.0, 0.0), frictionloss=motor.friction, armature=motor.armature
    )
    actuator = spec.add_actuator(target="hinge", trntype=mujoco.mjtTrn.mjTRN_JOINT)
    motor.drive(actuator, kp=kp, kd=kd)
    model = spec.compile()
    return model, mujoco.MjData(model)


def test_torque_lies_between_two_straight_lines():
    speed, least, most = np.array(ENVELOPE).T
    low, high = MOTOR.torque_range(speed)
    np.testing.assert_allclose(low, least, atol=1e-12)
    np.testing.assert_allclose(high, most, atol=1e-12)


@pytest.mark.parametrize(("speed", "least", "most"), ENVELOPE)
@pytest.mark.parametrize("error", [-3.0, -0.9, -0.2, 0.0, 0.31, 1.1, 3.0])
def test_the_simulated_motor_follows_the_pd_law_between_these_lines(speed, least, most, error):
    model, data = wheel(MOTOR)
    data.qpos[0], data.qvel[0], data.ctrl[0] = 0.7, speed, 0.7 + error
    mujoco.mj_forward(model, data)
    wanted = 40.0 * error - 1.5 * speed
    assert data.actuator_force[0] == pytest.approx(min(max(wanted, least), most), abs=1e-9)


def test_at_full_voltage_a_rotor_reaches_its_no_load_speed_exponentially():
    """I dω/dt = τ₀ (1 - ω/ω₀) gives ω = ω₀ (1 - exp(-t τ₀/(I ω₀)))."""
    motor = Motor(torque_limit=60.0, no_load_speed=20.0, stall_torque=60.0)
    model, data = wheel(motor, inertia=2.0, step=1e-4)
    for time in (0.2, 0.5, 1.0, 4.0):
        data.ctrl[0] = 1e4
        mujoco.mj_step(model, data, nstep=round((time - data.time) / 1e-4))
        expected = 20.0 * (1.0 - np.exp(-time * 60.0 / (2.0 * 20.0)))
        assert data.qvel[0] == pytest.approx(expected, rel=1e-3)


def test_friction_holds_a_smaller_torque_and_takes_its_share_of_a_larger_one():
    motor = replace(MOTOR, friction=2.0)
    model, data = wheel(motor, inertia=0.5, kd=0.0)
    data.ctrl[0] = 1.9 / 40.0
    mujoco.mj_step(model, data, nstep=200)
    assert abs(data.qvel[0]) < 1e-2
    mujoco.mj_resetData(model, data)
    for _ in range(50):
        data.ctrl[0] = data.qpos[0] + 7.0 / 40.0  # a torque of 7 N·m
        mujoco.mj_step(model, data)
    assert data.qvel[0] == pytest.approx(0.05 * (7.0 - 2.0) / 0.5, rel=0.01)


def test_the_rotor_is_turned_as_well():
    motor = replace(MOTOR, armature=0.3)
    model, data = wheel(motor, inertia=0.5, kd=0.0)
    data.ctrl[0] = 8.0 / 40.0
    mujoco.mj_forward(model, data)
    assert data.qacc[0] == pytest.approx(8.0 / 0.8, rel=1e-9)


def test_electrical_power_is_voltage_times_current():
    """At K = 1 N·m/A: I = τ, V = R I + ω, and what a braking motor gives back is lost."""
    torque = np.array([[10.0, -10.0, 10.0, -20.0, 0.0, 3.0] * 2])
    speed = np.array([[0.0, 0.0, 2.0, 12.0, 5.0, -0.5] * 2])
    resistance = 20.0 / 60.0
    volts = resistance * torque + speed
    assert (volts * torque < 0).any()
    expected = sum(v * i for v, i in zip(volts[0], torque[0], strict=True) if v * i > 0)
    assert MOTOR.electrical_power(torque, speed)[0] == pytest.approx(expected)
    still = MOTOR.electrical_power(np.full((1, 12), 6.0), np.zeros((1, 12)))
    assert still == pytest.approx(12 * 36.0 / 3.0)


def test_a_motor_is_saturated_at_its_limit_and_on_its_lines():
    torque = np.array([30.0, -30.0, 29.0, 18.0, 17.0, -30.0, 0.0])
    speed = np.array([0.0, 3.0, 0.0, 14.0, 14.0, -9.0, 20.0])
    expected = [True, True, False, True, False, True, True]
    np.testing.assert_array_equal(MOTOR.is_saturated(torque, speed), expected)


def test_the_robots_joints_have_this_motor_and_its_gains():
    """Torques of a robot in the air, against the wheel's."""
    motor = Motor(
        torque_limit=25.0, no_load_speed=12.0, stall_torque=40.0, friction=0.4, armature=0.02
    )
    robot = replace(ANYMAL_B, motor=motor)
    plain = ANYMAL_B.spec(Gains(kp=35.0, kd=0.8)).compile()
    model = robot.spec(Gains(kp=35.0, kd=0.8)).compile()
    np.testing.assert_allclose(model.dof_frictionloss[6:], plain.dof_frictionloss[6:] + 0.4)
    np.testing.assert_allclose(model.dof_armature[6:], plain.dof_armature[6:] + 0.02)
    rng, data = np.random.default_rng(3), mujoco.MjData(model)
    for _ in range(20):
        data.qpos[7:] = robot.stance_angles + rng.uniform(-0.3, 0.3, 12)
        data.qvel[6:] = rng.uniform(-15.0, 15.0, 12)
        data.ctrl[:] = data.qpos[7:] + rng.uniform(-1.5, 1.5, 12)
        mujoco.mj_forward(model, data)
        for joint in range(12):
            one, at = wheel(motor, kp=35.0, kd=0.8)
            at.qpos[0], at.qvel[0] = data.qpos[7 + joint], data.qvel[6 + joint]
            at.ctrl[0] = data.ctrl[joint]
            mujoco.mj_forward(one, at)
            assert data.actuator_force[joint] == pytest.approx(at.actuator_force[0], abs=1e-9)


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"torque_limit": 0.0}, "torque_limit must be 0.01 to 10000, got 0"),
        ({"no_load_speed": float("nan")}, "no_load_speed must be 0.1 to 1000, got nan"),
        ({"stall_torque": 29.0}, "stall_torque must be at least torque_limit (30 N·m), got 29"),
        ({"friction": -0.1}, "friction must be 0 to 1000, got -0.1"),
        ({"armature": float("inf")}, "armature must be 0 to 100, got inf"),
        ({"thermal_resistance": -1.0}, "thermal_resistance must be 0 to 1000, got -1"),
    ],
)
def test_a_motor_that_cannot_be_is_refused(change, says):
    with pytest.raises(GaitshiftError, match=re.escape(says)):
        replace(MOTOR, **change)
