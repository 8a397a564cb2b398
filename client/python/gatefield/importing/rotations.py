"""Rotations as 3x3 matrices: columns are the turned frame's axes."""

import math

import numpy as np

FLIP = np.diag([1.0, -1.0, -1.0])  # NED to a world with z up and the same x, and FRD to FLU; its own inverse


def about(axis, angle_rad):
    """About x, y or z (0, 1, 2)."""
    c, s = math.cos(angle_rad), math.sin(angle_rad)
    R = np.eye(3)
    a, b = (axis + 1) % 3, (axis + 2) % 3
    R[a, a], R[a, b], R[b, a], R[b, b] = c, -s, s, c
    return R


def of_quaternion(node):
    """Of a node with w, x, y, z; within 2 % of length 1, since another order or unit often is not."""
    w, x, y, z = node.vector(4, "a quaternion of 4 numbers")
    length = math.sqrt(w * w + x * x + y * y + z * z)
    if not 0.98 <= length <= 1.02:
        node.refuse("a quaternion of length 1")
    w, x, y, z = (value / length for value in (w, x, y, z))
    return np.array([[1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
                     [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
                     [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)]])


def of_rpy(rpy_rad):
    """Roll about the fixed x, then pitch about the fixed y, then yaw about the fixed z."""
    roll, pitch, yaw = rpy_rad
    return about(2, yaw) @ about(1, pitch) @ about(0, roll)


def of_axis(axis, angle_rad):
    """About any axis (Rodrigues)."""
    x, y, z = np.asarray(axis, float) / np.linalg.norm(axis)
    K = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + math.sin(angle_rad) * K + (1 - math.cos(angle_rad)) * K @ K


def yaw_deg(direction):
    return math.degrees(math.atan2(direction[1], direction[0]))
