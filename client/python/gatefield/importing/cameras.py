"""Camera calibrations, and the vehicle file whose camera they become."""

import math
from dataclasses import dataclass, field
from pathlib import Path
from typing import List, Optional, Sequence

import numpy as np

from gatefield.errors import Invalid
from gatefield.options import Camera

from .needs import Needs
from .rotations import about
from .source import content
from .text import camera_block, replace_block

_LEVEL = np.array([[0.0, 0, 1], [-1, 0, 0], [0, -1, 0]])  # optical axes in B of a camera that looks along x


@dataclass
class Lens:
    """What a calibration says; None: nothing. Pixel centres at whole numbers, as OpenCV, ROS, RealSense have them."""

    focal_px: Sequence[float]
    centre_px: Sequence[float]
    size_px: Optional[Sequence[int]] = None
    distortion: Optional[Sequence[float]] = None  # k1, k2, p1, p2, k3
    metres_per_count: Optional[float] = None
    notes: List[str] = field(default_factory=list)


def mount_of(X_BC):
    """x, y, z in metres, yaw left, pitch up, roll in degrees, as `mount` in a vehicle file has them."""
    X_BC = np.asarray(X_BC, float)
    R = X_BC[:3, :3]
    forward = R[:, 2]
    pitch, yaw = math.asin(max(-1.0, min(1.0, forward[2]))), math.atan2(forward[1], forward[0])
    rest = (about(2, yaw) @ about(1, -pitch) @ _LEVEL).T @ R
    angles = (math.degrees(angle) for angle in (yaw, pitch, math.atan2(rest[1, 0], rest[0, 0])))
    return (*X_BC[:3, 3], *angles)


def five_terms(node, what="k1, k2, p1, p2, k3"):
    """The first five coefficients of a node's list; further ones have to be 0."""
    values = [item.number() for item in node.nodes(f"a list of coefficients, {what}")]
    if len(values) not in (0, 4, 5, 8, 12, 14):
        node.refuse(f"4 or 5 coefficients, {what}")
    if any(values[5:]):
        node.refuse(f"no more than {what}: send rectified images, and say --rectified")
    return tuple((values + [0.0] * 5)[:5])


def vehicle_with_camera(path, lens, options, head):
    """The text of --vehicle's file with the calibrated camera in place of its own."""
    needs = Needs(path, options)
    size = needs.take("size", lens.size_px, "how large the images are", "--size WIDTH HEIGHT", "in pixels")
    distortion = (0.0,) * 5 if options.rectified else lens.distortion
    if distortion is None:
        needs.miss("rectified", "how the lens distorts", "--rectified", "the images are sent rectified")
    near = needs.take("min_depth", None, "from where on depth is measured", "--min-depth M")
    far = needs.take("max_depth", None, "up to where depth is measured", "--max-depth M")
    rate = needs.take("rate", None, "how many frames it sends", "--rate HZ")
    mount = needs.take("mount", None, "where it sits", "--mount X Y Z YAW_LEFT PITCH_UP ROLL",
                       "metres in the body frame and degrees; a camera that looks ahead, 15 degrees up: 0 0 0 0 15 0")
    vehicle = needs.take("vehicle", None, "what vehicle it is on", "--vehicle FILE",
                         "a vehicle file, whose camera it replaces")
    needs.check()
    counts = options.metres_per_count or lens.metres_per_count
    if counts is None:
        counts = 0.001
        lens.notes.append("16-bit images were taken for millimetres (--metres-per-count)")
    n = options.decimate
    camera = Camera(_divided(path, size[0], n), _divided(path, size[1], n), lens.focal_px[0] / n, lens.focal_px[1] / n,
                    (lens.centre_px[0] + 0.5) / n, (lens.centre_px[1] + 0.5) / n, near, far, rate,
                    metres_per_count=counts, distortion_model="brown_conrady" if any(distortion) else "none",
                    distortion=distortion)
    lens.notes.append("pixel centres lie at 0.5 here: 0.5 was added to cx and cy" +
                      (f", and all was divided by {n} (--decimate)" if n > 1 else ""))
    file = Path(vehicle)
    text = replace_block(content(file), "camera", camera_block(camera, mount, head + lens.notes))
    if text is None:
        raise Invalid(f"{file} has no camera {{ .. }}, expected a vehicle file (docs/courses-and-vehicles.md)",
                      "invalid", "camera", file=str(file))
    return text


def _divided(path, pixels, n):
    if pixels % n:
        raise Invalid(f"{path}: its images are {pixels} pixels wide or high, expected a multiple of --decimate {n}",
                      "invalid", "--decimate", str(n), file=str(path))
    return int(pixels) // n
