"""Rigid bodies put together: masses, centres of mass and inertias in one frame."""

from dataclasses import dataclass

import numpy as np


@dataclass
class Part:
    """A mass, its centre and its inertia about that centre, both in the frame of the whole."""

    mass_kg: float
    centre: np.ndarray
    inertia: np.ndarray


def together(parts):
    """The Part that they make, glued to each other (parallel axes: I + m (|d|^2 1 - d d^T))."""
    mass = sum(part.mass_kg for part in parts)
    if mass <= 0:
        return None
    centre = sum(part.mass_kg * part.centre for part in parts) / mass
    inertia = np.zeros((3, 3))
    for part in parts:
        d = part.centre - centre
        inertia = inertia + part.inertia + part.mass_kg * (d @ d * np.eye(3) - np.outer(d, d))
    return Part(mass, centre, inertia)


def of_shape(kind, mass, size):
    """Inertia of a solid about its centre. size: radii or half edges; cylinder and capsule: radius and half length."""
    if kind == "sphere":
        return 0.4 * mass * size[0]**2 * np.eye(3)
    if kind in ("box", "ellipsoid"):
        a, b, c = np.square(size)
        return mass / (3 if kind == "box" else 5) * np.diag([b + c, a + c, a + b])
    radius, half = size[0], size[1]
    across = mass * (radius**2 / 4 + half**2 / 3)
    if kind == "cylinder":
        return np.diag([across, across, mass * radius**2 / 2])
    # A capsule: the cylinder and two half spheres, whose centres of mass lie 3/8 of the radius beyond its ends.
    ball = mass * (4 / 3 * radius) / (4 / 3 * radius + 2 * half)
    bar = mass - ball
    across = bar * (radius**2 / 4 + half**2 / 3) + ball * (0.4 * radius**2 + half**2 + 0.75 * half * radius)
    return np.diag([across, across, bar * radius**2 / 2 + 0.4 * ball * radius**2])


def volume(kind, size):
    """Of the same shapes, m^3."""
    if kind == "sphere":
        return 4 / 3 * np.pi * size[0]**3
    if kind in ("box", "ellipsoid"):
        return (8 if kind == "box" else 4 / 3 * np.pi) * size[0] * size[1] * size[2]
    return np.pi * size[0]**2 * 2 * size[1] + (4 / 3 * np.pi * size[0]**3 if kind == "capsule" else 0)
