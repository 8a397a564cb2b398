"""States and depth of other simulators as gatefield has them. Nothing of theirs is imported: arrays in, arrays out.

Gatefield: world z up (which way x points doesn't matter), body FLU, quaternions w, x, y, z, velocity in the world, body
rates in the body, depth along the optical axis with 0 for no return.
"""

import numpy as np

import gatefield

# A camera that looks along -z with y up (OpenGL's, MuJoCo's, Genesis's, USD's), in terms of the optical frame.
GL_TO_OPTICAL = np.diag([1.0, -1.0, -1.0])


def _rotation(q):
    w, x, y, z = q
    return np.array([[1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
                     [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
                     [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)]])


def from_mujoco(qpos, qvel, **thrusts):
    """Of a free joint: qpos (7,) has position and w, x, y, z; qvel (6,) velocity in the world, rates in the body."""
    return gatefield.State(qpos[:3], qvel[:3], qpos[3:7], qvel[3:6], **thrusts)


def from_world_rates(p_W, v_W, q_wxyz, w_W, **thrusts):
    """Genesis (get_pos, get_vel, get_quat, get_ang) and Isaac Lab's root_*_w: the rates are in the world's axes."""
    return gatefield.State(p_W, v_W, q_wxyz, _rotation(q_wxyz).T @ np.asarray(w_W, float), **thrusts)


def from_ned(p, v, q_wxyz, w_frd, **thrusts):
    """AirSim: world NED, body FRD, rates in the body. Both are turned by half a turn about x, so x stays x."""
    flip = np.array([1.0, -1.0, -1.0])
    w, x, y, z = q_wxyz
    return gatefield.State(flip * p, flip * v, [w, x, -y, -z], flip * w_frd, **thrusts)


def mount_of_gl_camera(p_BC, R_BC_gl):
    """Camera.X_BC of a camera that is mounted by OpenGL's axes: R_BC_gl (3, 3) turns them into the body's."""
    X_BC = np.eye(4)
    X_BC[:3, :3] = R_BC_gl @ GL_TO_OPTICAL
    X_BC[:3, 3] = p_BC
    return X_BC


def camera_of_fovy(width_px, height_px, fovy_deg, **other):
    """Of the vertical field of view, with square pixels (MuJoCo's cam_fovy, Genesis's fov)."""
    f = height_px / 2 / np.tan(np.radians(fovy_deg) / 2)
    return gatefield.Camera(width_px=width_px, height_px=height_px, fx_px=f, fy_px=f, cx_px=width_px / 2,
                            cy_px=height_px / 2, **other)


def z_depth_of_ray_lengths(camera, lengths):
    """Depth along the axis of lengths of rays (AirSim's DepthPerspective, Isaac's distance_to_camera)."""
    u, v = np.meshgrid(np.arange(camera.width_px) + 0.5, np.arange(camera.height_px) + 0.5)
    slope = np.sqrt(1 + ((u - camera.cx_px) / camera.fx_px)**2 + ((v - camera.cy_px) / camera.fy_px)**2)
    return (np.reshape(lengths, slope.shape) / slope).astype(np.float32)
