"""The robot: against the published figures of ANYmal B and hand-made kinematics."""

from dataclasses import replace

import mujoco
import numpy as np
import pytest

from gaitshift.errors import GaitshiftError
from gaitshift.robot.description import ANYMAL_B, Gains

# The figures of ANYbotics' anymal_b_simple_description, in the URDF's own names and order.
# Link, mass [kg], centre of mass [m]; then about that centre ixx ixy ixz, iyy iyz izz [kg·m²].
# ADAPTER and FOOT are the same on every leg. The dummy `base` (1e-6 kg) is left out.
PUBLISHED_LINKS = """
base_inertia 16.793507758 -0.001960558279 -0.001413217745 0.050207125344
  0.217391101503 -0.00132873239126 -0.00228200226173
  0.639432546734 -0.00138078263145 0.62414077654
imu_link 0.05 0 0 0
  1.60333333333e-05 0 0
  2.80333333333e-05 0 1.60333333333e-05
LF_HIP 1.42462064 0.064516258147 -0.003787101702 -0.000152184388
  0.00243023349564 -1.53023971e-05 -2.1819095354e-05
  0.00230257239103 2.6473021273e-05 0.0019806759227
LF_THIGH 1.634976467 -0.003897968082 0.054226618537 -0.214583373795
  0.0120367944369 6.762065206e-05 0.000287806340448
  0.0120643637939 -0.00140610131218 0.00249422574881
LF_SHANK 0.207204302 0.030816858139 -0.004617229294 0.000893125713
  0.0002104880248 -5.6750980345e-05 1.0127699391e-05
  0.000676270210023 -8.22869024e-07 0.000545032674924
RF_HIP 1.42462064 0.064516258147 0.003787101702 -0.000152184388
  0.00243023349564 1.53023971e-05 -2.1819095354e-05
  0.00230257239103 -2.6473021273e-05 0.0019806759227
RF_THIGH 1.634976467 -0.003897968082 -0.054226618537 -0.214583373795
  0.0120367944369 -6.762065206e-05 0.000287806340448
  0.0120643637939 0.00140610131218 0.00249422574881
RF_SHANK 0.207204302 0.030816858139 0.004617229294 0.000893125713
  0.0002104880248 5.6750980345e-05 1.0127699391e-05
  0.000676270210023 8.22869024e-07 0.000545032674924
LH_HIP 1.42462064 -0.064516258147 -0.003787101702 -0.000152184388
  0.00243023349564 1.53023971e-05 2.1819095354e-05
  0.00230257239103 2.6473021273e-05 0.0019806759227
LH_THIGH 1.634976467 0.003897968082 0.054226618537 -0.214583373795
  0.0120367944369 -6.762065206e-05 -0.000287806340448
  0.0120643637939 -0.00140610131218 0.00249422574881
LH_SHANK 0.207204302 -0.030816858139 -0.004617229294 0.000893125713
  0.0002104880248 5.6750980345e-05 -1.0127699391e-05
  0.000676270210023 -8.22869024e-07 0.000545032674924
RH_HIP 1.42462064 -0.064516258147 0.003787101702 -0.000152184388
  0.00243023349564 -1.53023971e-05 2.1819095354e-05
  0.00230257239103 -2.6473021273e-05 0.0019806759227
RH_THIGH 1.634976467 0.003897968082 -0.054226618537 -0.214583373795
  0.0120367944369 6.762065206e-05 -0.000287806340448
  0.0120643637939 0.00140610131218 0.00249422574881
RH_SHANK 0.207204302 -0.030816858139 0.004617229294 0.000893125713
  0.0002104880248 -5.6750980345e-05 -1.0127699391e-05
  0.000676270210023 8.22869024e-07 0.000545032674924
ADAPTER 0.140170767 -8.66e-10 -1.472e-09 -0.244345749188
  0.00159938741862 -9.32e-13 1.039e-11
  0.00159938741932 1.7563e-11 5.4423177329e-05
FOOT 0.001 0 0 0
  4.90e-07 0 0
  4.90e-07 0 4.90e-07
"""

# Where each link's frame lies in its parent's, at zero angles [m]. No frame is turned, but for the
# IMU's: half a turn about y, under which its diagonal inertia stays as it is.
PUBLISHED_ORIGINS = {
    "imu_link": (0.038, 0.06245, 0.1837),
    "LF_HIP": (0.277, 0.116, 0.0),
    "LF_THIGH": (0.0635, 0.041, 0.0),
    "LF_SHANK": (0.0, 0.109, -0.25),
    "LF_ADAPTER": (0.1, -0.02, 0.0),
    "RF_HIP": (0.277, -0.116, 0.0),
    "RF_THIGH": (0.0635, -0.041, 0.0),
    "RF_SHANK": (0.0, -0.109, -0.25),
    "RF_ADAPTER": (0.1, 0.02, 0.0),
    "LH_HIP": (-0.277, 0.116, 0.0),
    "LH_THIGH": (-0.0635, 0.041, 0.0),
    "LH_SHANK": (0.0, 0.109, -0.25),
    "LH_ADAPTER": (-0.1, -0.02, 0.0),
    "RH_HIP": (-0.277, -0.116, 0.0),
    "RH_THIGH": (-0.0635, -0.041, 0.0),
    "RH_SHANK": (0.0, -0.109, -0.25),
    "RH_ADAPTER": (-0.1, 0.02, 0.0),
}
FOOT_ORIGIN = (0.0, 0.0, -0.32125)
FOOT_CENTRE = (0.0, 0.0, 0.02325)
"""Of the foot's sphere in the foot's frame [m]."""
FOOT_RADIUS = 0.031
EFFORT, VELOCITY = 80.0, 15.0
"""Limits of every joint [N·m], [rad/s]."""
AXES = {"HAA": (1, 0, 0), "HFE": (0, 1, 0), "KFE": (0, 1, 0)}
TOTAL_MASS = 30.475397462 - 1e-6
"""Sum over the URDF less its dummy base link [kg]."""

OUR_LEG = {"LF": "FL", "RF": "FR", "LH": "BL", "RH": "BR"}
LEGS = tuple(OUR_LEG)


def published(link):
    """Mass, centre of mass and inertia matrix of a link of the table."""
    lines = PUBLISHED_LINKS.strip().splitlines()
    name = link if link in ("base_inertia", "imu_link") else link[3:]
    at = next(i for i, line in enumerate(lines) if line.split()[0] in (link, name))
    mass, *centre = map(float, lines[at].split()[1:])
    ixx, ixy, ixz = map(float, lines[at + 1].split())
    iyy, iyz, izz = map(float, lines[at + 2].split())
    return mass, np.array(centre), np.array([[ixx, ixy, ixz], [ixy, iyy, iyz], [ixz, iyz, izz]])


def fused(*parts):
    """Mass, centre and inertia about it of links (name, origin) fused into one frame."""
    figures = [(m, np.add(origin, c), i) for name, origin in parts for m, c, i in [published(name)]]
    mass = sum(m for m, _, _ in figures)
    centre = sum(m * c for m, c, _ in figures) / mass
    inertia = np.zeros((3, 3))
    for m, c, i in figures:
        d = c - centre
        inertia += i + m * (d @ d * np.eye(3) - np.outer(d, d))
    return mass, centre, inertia


def fused_shank(leg):
    adapter = np.array(PUBLISHED_ORIGINS[f"{leg}_ADAPTER"])
    foot = adapter + FOOT_ORIGIN
    return fused((f"{leg}_SHANK", (0, 0, 0)), (f"{leg}_ADAPTER", adapter), (f"{leg}_FOOT", foot))


def turn_x(angle):
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[1, 0, 0], [0, c, -s], [0, s, c]])


def turn_y(angle):
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]])


def foot_centres(angles):
    """Centres of the feet's spheres from the base origin (4, 3), for joint angles (12,)."""
    centres = []
    for leg, (haa, hfe, kfe) in zip(LEGS, np.reshape(angles, (4, 3)), strict=True):
        below_knee = np.add(PUBLISHED_ORIGINS[f"{leg}_ADAPTER"], FOOT_ORIGIN) + FOOT_CENTRE
        below_hip = PUBLISHED_ORIGINS[f"{leg}_SHANK"] + turn_y(kfe) @ below_knee
        beside_hip = PUBLISHED_ORIGINS[f"{leg}_THIGH"] + turn_y(hfe) @ below_hip
        centres.append(PUBLISHED_ORIGINS[f"{leg}_HIP"] + turn_x(haa) @ beside_hip)
    return np.array(centres)


def compiled():
    return ANYMAL_B.spec(ANYMAL_B.gains_of("default")).compile()


def at_angles(model, angles, position=(0, 0, 0), quaternion=(1, 0, 0, 0)):
    data = mujoco.MjData(model)
    data.qpos[:] = [*position, *quaternion, *angles]
    mujoco.mj_forward(model, data)
    return data


def modelled_feet(model, data):
    return np.array([data.site(f"{OUR_LEG[leg]}_foot").xpos for leg in LEGS])


def random_angles(model, seed, count):
    """Angles within the joints' limits, different on every joint."""
    low, high = model.jnt_range[1:].T
    return np.random.default_rng(seed).uniform(low, high, (count, 12))


def inertia_of(model, body):
    turn = np.zeros(9)
    mujoco.mju_quat2Mat(turn, model.body(body).iquat)
    turn = turn.reshape(3, 3)
    return turn @ np.diag(model.body(body).inertia) @ turn.T


def our_name(link):
    if link == "base_inertia":
        return "base"
    leg, _, part = link.partition("_")
    return f"{OUR_LEG[leg]}_{part.lower()}" if leg in OUR_LEG else link


ALL_LINKS = (
    "base_inertia",
    "imu_link",
    *(f"{leg}_{part}" for leg in LEGS for part in ("HIP", "THIGH", "SHANK", "ADAPTER", "FOOT")),
)


@pytest.mark.parametrize("link", ALL_LINKS)
def test_every_link_keeps_its_published_figures(link):
    body = mujoco.MjSpec.from_file(str(ANYMAL_B.model_file)).body(our_name(link))
    mass, centre, inertia = published(link)
    assert body.explicitinertial
    assert body.mass == mass
    np.testing.assert_array_equal(body.ipos, centre)
    ixx, iyy, izz, ixy, ixz, iyz = body.fullinertia
    np.testing.assert_array_equal([[ixx, ixy, ixz], [ixy, iyy, iyz], [ixz, iyz, izz]], inertia)


@pytest.mark.parametrize("link", ALL_LINKS[1:])
def test_every_link_lies_where_it_is_published(link):
    body = mujoco.MjSpec.from_file(str(ANYMAL_B.model_file)).body(our_name(link))
    origin = FOOT_ORIGIN if link.endswith("FOOT") else PUBLISHED_ORIGINS[link]
    np.testing.assert_array_equal(body.pos, origin)
    np.testing.assert_array_equal(body.quat, (0, 0, 1, 0) if link == "imu_link" else (1, 0, 0, 0))


def test_the_mass_is_that_of_all_links():
    assert ANYMAL_B.mass == pytest.approx(sum(published(link)[0] for link in ALL_LINKS), abs=1e-9)
    assert ANYMAL_B.mass == compiled().body_mass.sum()


def test_the_model_has_no_other_links():
    bodies = mujoco.MjSpec.from_file(str(ANYMAL_B.model_file)).bodies
    assert {body.name for body in bodies} == {"world", *map(our_name, ALL_LINKS)}


def test_mass_is_the_published_total():
    """30.4754 kg: the URDF's sum less the 1e-6 kg of its dummy base."""
    assert sum(published(link)[0] for link in ALL_LINKS) == pytest.approx(TOTAL_MASS, abs=1e-12)
    assert compiled().body_mass.sum() == pytest.approx(TOTAL_MASS, abs=1e-12)


COMPOSITES = {
    "base": fused(("base_inertia", (0, 0, 0)), ("imu_link", PUBLISHED_ORIGINS["imu_link"])),
    **{our_name(f"{leg}_HIP"): fused((f"{leg}_HIP", (0, 0, 0))) for leg in LEGS},
    **{our_name(f"{leg}_THIGH"): fused((f"{leg}_THIGH", (0, 0, 0))) for leg in LEGS},
    **{our_name(f"{leg}_SHANK"): fused_shank(leg) for leg in LEGS},
}
"""What moves as one: shank, adapter and foot of a leg; trunk and IMU."""


def test_compiled_bodies_are_the_links_fused_by_the_parallel_axis_theorem():
    model = compiled()
    assert {model.body(i).name for i in range(1, model.nbody)} == set(COMPOSITES)
    for name, (mass, centre, inertia) in COMPOSITES.items():
        body = model.body(name)
        assert body.mass[0] == pytest.approx(mass, rel=1e-12)
        np.testing.assert_allclose(body.ipos, centre, rtol=0, atol=1e-12)
        np.testing.assert_allclose(inertia_of(model, name), inertia, rtol=0, atol=1e-12)


def test_joints_are_in_the_package_order_on_the_published_axes():
    """At zero angles every anchor is the sum of the offsets above it."""
    model = compiled()
    data = at_angles(model, np.zeros(12))
    assert tuple(model.joint(i + 1).name for i in range(12)) == ANYMAL_B.joint_names
    assert tuple(model.actuator(i).name for i in range(12)) == ANYMAL_B.joint_names
    np.testing.assert_array_equal(model.actuator_trnid[:, 0], np.arange(12) + 1)
    links = {"HAA": ("HIP",), "HFE": ("HIP", "THIGH"), "KFE": ("HIP", "THIGH", "SHANK")}
    for leg in LEGS:
        for joint, above in links.items():
            index = model.joint(f"{OUR_LEG[leg]}_{joint}").id
            anchor = sum(np.array(PUBLISHED_ORIGINS[f"{leg}_{link}"]) for link in above)
            np.testing.assert_allclose(data.xanchor[index], anchor, rtol=0, atol=1e-15)
            np.testing.assert_array_equal(data.xaxis[index], AXES[joint])


def test_effort_and_speed_limits_are_the_published_ones():
    assert ANYMAL_B.motor.torque_limit == EFFORT
    assert ANYMAL_B.motor.no_load_speed == VELOCITY
    np.testing.assert_array_equal(compiled().actuator_forcerange, [[-EFFORT, EFFORT]] * 12)


def test_feet_are_where_trigonometry_puts_them():
    model = compiled()
    for angles in random_angles(model, seed=0, count=20):
        feet = modelled_feet(model, at_angles(model, angles))
        np.testing.assert_allclose(feet, foot_centres(angles), rtol=0, atol=1e-14)


def test_foot_sensors_follow_a_base_that_is_moved_and_turned():
    """Half a turn about the diagonal of x and z takes (x, y, z) to (z, -y, x)."""
    model = compiled()
    angles = random_angles(model, seed=1, count=1)[0]
    data = at_angles(
        model, angles, position=(3.0, -2.0, 5.0), quaternion=(0, np.sqrt(0.5), 0, np.sqrt(0.5))
    )
    expected = foot_centres(angles)[:, ::-1] * (1, -1, 1) + (3.0, -2.0, 5.0)
    sensed = np.array([data.sensor(f"{OUR_LEG[leg]}_position").data for leg in LEGS])
    np.testing.assert_allclose(sensed, expected, rtol=0, atol=1e-14)


def test_feet_are_the_published_spheres():
    model = compiled()
    assert ANYMAL_B.foot_radius == FOOT_RADIUS
    for leg in OUR_LEG.values():
        assert model.geom(f"{leg}_foot").type[0] == mujoco.mjtGeom.mjGEOM_SPHERE
        assert model.geom(f"{leg}_foot").size[0] == FOOT_RADIUS


def test_soles_touch_level_ground_at_the_stance_height():
    soles = foot_centres(ANYMAL_B.stance)[:, 2] - FOOT_RADIUS + ANYMAL_B.stance_height
    np.testing.assert_allclose(soles, 0.0, rtol=0, atol=1e-3)


def test_mirrored_angles_give_mirrored_feet():
    """Legs change sides and hip abduction its sign; then every foot's y changes its sign."""
    model = compiled()
    mirror_image = {"FL": "FR", "FR": "FL", "BL": "BR", "BR": "BL"}
    for angles in random_angles(model, seed=2, count=20):
        mirrored = np.empty(12)
        for i, name in enumerate(ANYMAL_B.joint_names):
            leg, joint = name.split("_")
            source = ANYMAL_B.joint_names.index(f"{mirror_image[leg]}_{joint}")
            mirrored[i] = -angles[source] if joint == "HAA" else angles[source]
        feet, image = at_angles(model, angles), at_angles(model, mirrored)
        for leg, other in mirror_image.items():
            np.testing.assert_allclose(
                image.site(f"{leg}_foot").xpos,
                feet.site(f"{other}_foot").xpos * (1, -1, 1),
                rtol=0,
                atol=1e-14,
            )


def test_masses_of_left_and_right_legs_mirror_each_other():
    """Within the 3 nm by which the adapter's published centre leaves the plane of its own leg."""
    model = compiled()
    flip = np.diag([1.0, -1.0, 1.0])
    for left, right in (("FL", "FR"), ("BL", "BR")):
        for part in ("hip", "thigh", "shank"):
            this, other = model.body(f"{left}_{part}"), model.body(f"{right}_{part}")
            assert this.mass[0] == pytest.approx(other.mass[0], rel=1e-12)
            np.testing.assert_allclose(this.ipos, flip @ other.ipos, rtol=0, atol=3e-9)
            image = flip @ inertia_of(model, f"{right}_{part}") @ flip
            np.testing.assert_allclose(
                inertia_of(model, f"{left}_{part}"), image, rtol=0, atol=1e-10
            )


def test_the_trunk_is_not_its_own_mirror_image():
    """Its published centre lies 1.4 mm right of the middle and its inertia has mixed terms in y."""
    _, centre, inertia = published("base_inertia")
    assert centre[1] == pytest.approx(-1.4e-3, abs=0.05e-3)
    assert abs(inertia[0, 1]) > 1e-3
    assert abs(inertia[1, 2]) > 1e-3


@pytest.mark.parametrize("leg", range(4))
def test_knees_stop_before_the_leg_is_straight(leg):
    """The foot comes nearer to the hip all the way from the angle 0: no leg folds both ways."""
    low, high = compiled().joint(f"{list(OUR_LEG.values())[leg]}_KFE").range
    assert min(abs(low), abs(high)) == 0.0
    bends = np.linspace(0.0, low + high, 50)
    hip = np.add(PUBLISHED_ORIGINS[f"{LEGS[leg]}_HIP"], PUBLISHED_ORIGINS[f"{LEGS[leg]}_THIGH"])
    feet = [foot_centres(np.eye(12)[3 * leg + 2] * bend)[leg] for bend in bends]
    assert (np.diff(np.linalg.norm((feet - hip)[:, [0, 2]], axis=1)) < 0).all()


def test_unknown_gains_are_refused_and_the_known_ones_named():
    with pytest.raises(GaitshiftError) as error:
        ANYMAL_B.gains_of("stiff")
    assert str(error.value) == "robot anymal_b: gains must be one of default, paper, got 'stiff'"


@pytest.mark.parametrize("length", [0, 11, 13])
def test_a_stance_of_another_length_is_refused(length):
    with pytest.raises(
        GaitshiftError, match=r"^robot anymal_b: stance must have 12 joint angles, got \d+$"
    ):
        replace(ANYMAL_B, stance=(0.1,) * length)


def test_gains_without_a_default_are_refused():
    with pytest.raises(
        GaitshiftError, match=r"^robot anymal_b: gains must have a preset 'default'"
    ):
        replace(ANYMAL_B, gains={"paper": Gains(kp=3.0, kd=0.2)})
