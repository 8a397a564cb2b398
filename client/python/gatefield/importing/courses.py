"""A course as its source says it, and the course file that this becomes with what the options add."""

import math
from dataclasses import dataclass, field, replace
from typing import List, Optional, Sequence, Tuple

import numpy as np

from gatefield.errors import Invalid
from gatefield.options import Course, GateShape, Track, Waypoint

from .needs import Needs
from .text import course_text, number

AXES = {"x": (1, 0, 0), "-x": (-1, 0, 0), "y": (0, 1, 0), "-y": (0, -1, 0), "z": (0, 0, 1), "-z": (0, 0, -1)}


@dataclass
class Gate:
    """One passage, in W (z up); the way through is `direction_W`, or an axis of the gate's own frame.

    R_WG: rotation from that frame. opening_m, frame_m: full widths inside and outside, None: the file does not say.
    scale: of the opening and frame that the options say.
    """

    p_W: Sequence[float]
    direction_W: Optional[Sequence[float]] = None
    R_WG: Optional[np.ndarray] = None
    opening_m: Optional[float] = None
    frame_m: Optional[float] = None
    scale: float = 1.0


@dataclass
class Layout:
    """What a source says of a course; None: nothing. Metres, W: z up."""

    title: str
    gates: List[Gate]
    laps: Optional[int] = None
    closed: Optional[bool] = None
    gate_axis: Optional[str] = None  # one of AXES, that gates with an R_WG are passed along
    gate_axis_hint: str = ""
    start_p_W: Optional[Sequence[float]] = None
    start_yaw_rad: float = 0.0
    volume: Optional[Tuple[Sequence[float], Sequence[float]]] = None
    floor_z_m: Optional[float] = None
    poles: List[Tuple[float, float, float]] = field(default_factory=list)  # x, y, top
    notes: List[str] = field(default_factory=list)


def _directions(layout, needs):
    """Of each gate; None when the axis is missing."""
    if all(gate.R_WG is None for gate in layout.gates):
        return [gate.direction_W for gate in layout.gates]
    axis = needs.take("gate_axis", layout.gate_axis, "along which of its own axes a gate is passed",
                      "--gate-axis x, -x, y or -y", layout.gate_axis_hint)
    if axis is None:
        return None
    how = "--gate-axis" if needs.given("gate_axis") else "--gate-axis says otherwise"
    layout.notes.append(f"gates are passed along their own {axis} axis ({how})")
    for i, gate in enumerate(layout.gates):
        _check_roll(layout, i, gate, AXES[axis], needs)
    return [tuple(gate.R_WG @ AXES[axis]) for gate in layout.gates]


def _check_roll(layout, i, gate, axis, needs):
    """Gates here have two level edges; one that is turned about the way through is said, or refused when by much."""
    way = gate.R_WG @ axis
    edge = gate.R_WG @ np.roll(axis, 1)
    level = np.cross((0, 0, 1), way)
    if needs.given("round") or np.linalg.norm(level) < 1e-3:
        return
    level /= np.linalg.norm(level)
    roll = math.degrees(math.atan2(edge @ np.cross(way, level), edge @ level))
    roll = abs((roll + 45) % 90 - 45)  # a square is the same after a quarter
    if roll > 10:
        raise Invalid(f"{needs.file}: gate {i} is turned by {roll:.3g} degrees about the way through it, expected at "
                      "most 10: square gates here have two level edges", "invalid", f"gates[{i}]", f"{roll:.3g}",
                      "at most 10", str(needs.file))
    if roll > 1:
        layout.notes.append(f"gate {i} is turned by {roll:.3g} degrees about the way through it, which was left out")


def _shapes(layout, needs):
    """Of each gate, in the source's size; None when something is missing. An option replaces what the file says."""
    told = {"opening": all(gate.opening_m is not None for gate in layout.gates) or None,
            "frame": all(gate.frame_m is not None for gate in layout.gates) or None}
    opening = needs.take("opening", told["opening"], "how wide the gates' openings are", "--opening M")
    frame = needs.take("frame", told["frame"], "how wide the gates are outside", "--frame M")
    thickness = needs.take("thickness", None, "how thick the frames are along the way through", "--thickness M")
    if None in (opening, frame, thickness):
        return None
    kind = "round" if needs.given("round") else "square"
    return [GateShape(kind, 0.5 * (gate.opening_m if opening is True else gate.scale * opening),
                      0.5 * (gate.frame_m if frame is True else gate.scale * frame), thickness)
            for gate in layout.gates]


def _floor(layout, needs):
    if needs.given("no_floor"):
        return None
    return needs.take("floor", layout.floor_z_m, "where the floor is", "--floor Z or --no-floor")


def _start(layout, needs, lowest_z):
    """Where the vehicle hovers before the race, and its heading."""
    given = needs.given("start")
    if given is not None:
        return tuple(given[:3]), math.radians(given[3])
    start = needs.take("start", layout.start_p_W, "where the vehicle starts", "--start X Y Z YAW_DEG")
    if start is None:
        return None, 0.0
    if lowest_z is not None and start[2] < lowest_z + 0.3:
        height = layout.gates[0].p_W[2]
        layout.notes.append(f"starts at z = {number(start[2])} m, on the floor; a vehicle here hovers before the race, "
                            f"so the start was raised to the first gate's height, {number(height)} m (--start says "
                            "otherwise)")
        start = (start[0], start[1], height)
    return tuple(start), layout.start_yaw_rad


def _volume(layout, needs, points, reach_m, floor_z_m):
    """Lower and upper corner."""
    given, margin = needs.given("volume"), needs.given("margin")
    if given is not None:
        return tuple(given[:3]), tuple(given[3:])
    if margin is not None:
        low, high = np.min(points, axis=0) - reach_m - margin, np.max(points, axis=0) + reach_m + margin
        if floor_z_m is not None:
            low[2] = floor_z_m
        return tuple(low), tuple(high)
    return needs.take("margin", layout.volume, "in which room is flown",
                      "--margin M (around gates and start) or --volume X Y Z X Y Z (its corners)")


def _scaled(values, scale):
    return tuple(scale * value for value in values)


def _scaled_shape(shape, scale):
    return replace(shape, inner_half_m=scale * shape.inner_half_m, outer_half_m=scale * shape.outer_half_m,
                   thickness_m=scale * shape.thickness_m)


def course_file(path, layout, options, head):
    """The text of the course file. Lengths of the options are of the source's size; --scale multiplies all of them."""
    needs = Needs(path, options)
    scale = options.scale
    directions = _directions(layout, needs)
    shapes = _shapes(layout, needs)
    floor = _floor(layout, needs)
    start, start_yaw = _start(layout, needs, floor)
    laps = needs.take("laps", layout.laps, "how many laps are flown", "--laps N", "1: it ends at the last gate")
    if options.no_poles and layout.poles:
        layout.notes.append(f"its {len(layout.poles)} obstacles were left out (--no-poles)")
        layout.poles = []
    width = needs.take("pole_width", None if layout.poles else 0.0, "how thick its obstacles are",
                       "--pole-width M, or --no-poles")
    points = np.array([gate.p_W for gate in layout.gates] + ([start] if start is not None else []), float)
    reach = max(shape.outer_half_m for shape in shapes) if shapes else 0.0
    volume = _volume(layout, needs, points, reach, floor)
    needs.check()
    if layout.poles and floor is None:
        raise Invalid(f"{path} has obstacles that stand on the floor, expected --floor Z in place of --no-floor",
                      "invalid", "--no-floor", file=str(path))
    if scale != 1:
        layout.notes.append(f"every length is {number(scale)} times the source's (--scale)")
    waypoints = [Waypoint(_scaled(gate.p_W, scale), tuple(direction), _scaled_shape(shape, scale))
                 for gate, direction, shape in zip(layout.gates, directions, shapes)]
    closed = layout.closed if layout.closed is not None else laps > 1
    course = Course(waypoints, int(laps), closed, None if floor is None else scale * floor)
    track = Track(course, _scaled(start, scale), start_yaw, tuple(_scaled(corner, scale) for corner in volume),
                  options.title or layout.title)
    return course_text(head + layout.notes, track, [_scaled(pole, scale) for pole in layout.poles], scale * width)
