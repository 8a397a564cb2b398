"""examples/simulators.py: one attitude and motion, told as each simulator tells it."""

import numpy as np
import pytest

import gatefield
from numpy_world import rotation
from simulators import (camera_of_fovy, from_mujoco, from_ned, from_world_rates, mount_of_gl_camera,
                        z_depth_of_ray_lengths)

RANDOM = np.random.default_rng(5)
Q = RANDOM.normal(size=4)
Q /= np.linalg.norm(Q)
R = rotation(Q[None])[0]  # W from B
P, V, W_B = RANDOM.normal(size=(3, 3))
FLIP = np.diag([1.0, -1.0, -1.0])


def same(state):
    R_told = rotation(np.asarray(state.q_WB_wxyz, float)[None])[0]
    for told, true in ((R_told, R), (state.p_WB, P), (state.v_WB, V), (state.w_WB_B, W_B)):
        assert np.asarray(told) == pytest.approx(true, abs=1e-12)


def quaternion(matrix):
    """Of a matrix, by its eigenvector of 1 and the turn about it."""
    w = np.sqrt(max(0.0, 1 + np.trace(matrix))) / 2
    x = np.array([matrix[2, 1] - matrix[1, 2], matrix[0, 2] - matrix[2, 0], matrix[1, 0] - matrix[0, 1]]) / (4 * w)
    return np.concatenate([[w], x])


def test_mujoco():
    same(from_mujoco(np.concatenate([P, Q]), np.concatenate([V, W_B])))


def test_rates_of_the_world():
    same(from_world_rates(P, V, Q, R @ W_B))


def test_ned():
    """The matrix from FRD to NED, where NED is our W turned about x by half a turn, and FRD our B."""
    same(from_ned(FLIP @ P, FLIP @ V, quaternion(FLIP @ R @ FLIP), FLIP @ W_B))


def test_a_gl_camera_that_looks_forward():
    R_BC_gl = np.array([[0, 0, -1], [-1, 0, 0], [0, 1, 0.0]])  # right is -y, up is z, and it looks along x
    assert mount_of_gl_camera([0.1, 0, 0], R_BC_gl) == pytest.approx(
        np.array(gatefield.forward_camera_mount(0.0, (0.1, 0, 0))))


def test_a_camera_of_one_field_of_view():
    camera = camera_of_fovy(64, 48, 90, rate_hz=30)
    assert camera.fx_px == camera.fy_px == pytest.approx(24) and (camera.cx_px, camera.cy_px) == (32, 24)


def test_lengths_of_rays():
    camera = gatefield.Camera()
    u, v = np.meshgrid(np.arange(160) + 0.5, np.arange(90) + 0.5)
    rays = np.stack([(u - camera.cx_px) / camera.fx_px, (v - camera.cy_px) / camera.fy_px, np.ones_like(u)], axis=-1)
    assert z_depth_of_ray_lengths(camera, 3 * np.linalg.norm(rays, axis=-1)) == pytest.approx(3)
