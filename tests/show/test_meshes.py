"""The robot's own surfaces: ANYbotics' meshes on our model, and what happens without them."""

from importlib import metadata
from pathlib import Path

import mujoco
import numpy as np
import pytest

from gaitshift.robot import urdf
from gaitshift.robot.description import ANYMAL_B, Robot
from gaitshift.show.geometry import Shape, has_meshes, meshes, put_on

needs_meshes = pytest.mark.skipif(
    not has_meshes(ANYMAL_B), reason="the extra [meshes] is not installed"
)


@pytest.fixture
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty cache."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    return tmp_path / "gaitshift"


def _dressed(robot: Robot = ANYMAL_B) -> mujoco.MjModel:
    spec = robot.spec(robot.gains_of("default"))
    put_on(spec, robot)
    return spec.compile()


def _plain() -> mujoco.MjModel:
    return ANYMAL_B.spec(ANYMAL_B.gains_of("default")).compile()


def _standing(model: mujoco.MjModel) -> mujoco.MjData:
    data = mujoco.MjData(model)
    data.qpos[:] = 0.0, 0.0, ANYMAL_B.stance_height, 1.0, 0.0, 0.0, 0.0, *ANYMAL_B.stance
    mujoco.mj_forward(model, data)
    return data


@needs_meshes
def test_the_meshes_are_on_the_bodies_that_move_them():
    """The hull of a leg's meshes holds its joints; the sole of its foot is where ours is."""
    shape = Shape(ANYMAL_B)
    bodies = {body.name: body for body in shape.bodies}
    assert len(bodies) == 13
    model = _plain()
    for leg in ("FL", "FR", "BL", "BR"):
        for parent, child in (("hip", "thigh"), ("thigh", "shank")):
            joint = model.body(f"{leg}_{child}").pos
            low, high = bodies[f"{leg}_{parent}"].mesh.bounds
            assert (low - 0.02 <= joint).all()
            assert (joint <= high + 0.02).all()
    position, _ = shape.poses(_standing(model).qpos[None])
    assert len(position) == 13
    for leg in ("FL", "FR", "BL", "BR"):
        sole = model.geom(f"{leg}_foot").pos[2] - ANYMAL_B.foot_radius
        low = bodies[f"{leg}_shank"].mesh.bounds[0][2]
        assert low == pytest.approx(sole, abs=0.008)


@needs_meshes
def test_left_and_right_are_mirror_images():
    """Up to fittings: bounds agree to 1 cm."""
    bodies = {body.name: body.mesh.bounds for body in Shape(ANYMAL_B).bodies}
    for part in ("hip", "thigh", "shank"):
        for end in ("F", "B"):
            left, right = bodies[f"{end}L_{part}"].copy(), bodies[f"{end}R_{part}"]
            left[:, 1] = -left[::-1, 1]
            np.testing.assert_allclose(left, right, atol=0.01)


@needs_meshes
def test_meshes_are_looks_alone():
    """A robot with them falls, and stands, exactly like one without."""
    plain, dressed = _plain(), _dressed()
    assert dressed.nmesh > 0
    assert dressed.body_mass.tolist() == plain.body_mass.tolist()
    one, other = _standing(plain), _standing(dressed)
    for _ in range(200):
        mujoco.mj_step(plain, one)
        mujoco.mj_step(dressed, other)
    assert one.qpos.tolist() == other.qpos.tolist()


@needs_meshes
@pytest.mark.slow
def test_they_are_converted_once(cache: Path, monkeypatch: pytest.MonkeyPatch):
    first = _dressed()
    (kept,) = cache.iterdir()
    assert metadata.version("example-robot-data") in kept.name

    def refuse(urdf: Path) -> list[meshes.Part]:
        raise AssertionError("converted again")

    with monkeypatch.context() as patched:
        patched.setattr(meshes, "convert", refuse)
        second = _dressed()
    np.testing.assert_allclose(first.mesh_vert, second.mesh_vert, atol=1e-6)
    kept.write_bytes(b"not a cache")
    assert _dressed().nmesh == first.nmesh, "a damaged file is made anew"
    assert _dressed().nmesh == first.nmesh


@needs_meshes
def test_a_cache_that_cannot_be_written_is_done_without(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "file"))
    assert _dressed().nmesh > 0


def test_without_the_extra_it_is_drawn_from_primitives(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(meshes, "_NEEDED", ("no_such_package",))
    assert not has_meshes(ANYMAL_B)
    assert _dressed().nmesh == 0
    assert len(Shape(ANYMAL_B).bodies) == 13


def test_without_the_wheel_it_is_drawn_from_primitives(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(urdf, "WHEEL", "no-such-wheel")
    assert not has_meshes(ANYMAL_B)
