"""Gate files of UZH's Robotics and Perception Group (YAML): gates with poses, and tracks of CPC, which are points."""

import math

import numpy as np

from .courses import Gate, Layout
from .rotations import of_quaternion, yaw_deg
from .source import read_yaml

SAME_M = 1e-3


def read(path, _options):
    """`gates: { N: .., Gate1: { position, rotation }, .. }`, flown as numbered, or as `orders` says."""
    track = read_yaml(path)
    table = track.need("gates")
    orders = track.find("orders") or table.find("orders")
    if orders is not None:
        names = [node.value for node in orders.nodes("a list of gates' names")]
    else:
        names = [f"Gate{i + 1}" for i in range(table.need("N").whole(1, 64, "how many gates there are"))]
    gates = []
    for name in names:
        gate = table.need(str(name))
        size = gate.find("width", "size")
        gates.append(Gate(gate.need("position").vector(3, "x, y, z in metres"),
                          R_WG=of_quaternion(gate.need("rotation")),
                          opening_m=size.positive("a width in metres above 0") if size is not None else None))
    if not gates:
        table.refuse("at least one gate")
    layout = Layout(f"UZH, {path.stem}", gates, gate_axis="x", notes=["rotations were read as quaternions w, x, y, z"])
    _initial(track, layout)
    return layout


def read_cpc(path, options):
    """`gates: [[x, y, z], ..]`, `initial: { position, attitude }`, `end`, `ring`: points without a direction."""
    track = read_yaml(path)
    points = [node.vector(3, "x, y, z in metres") for node in track.need("gates").nodes("a list of points [x, y, z]")]
    if len(points) < 2:
        track.need("gates").refuse("at least two points: the ways through follow from the neighbours")
    ring = track.find("ring")
    if ring is not None and not isinstance(ring.value, bool):
        ring.refuse("true or false")
    layout = Layout(f"CPC, {path.stem}", [], laps=None)
    lap = _lap_length(points)
    closed = lap < len(points) or bool(ring is not None and ring.value)
    if lap < len(points):
        whole = len(points) // lap
        layout.laps = whole
        rest = len(points) - whole * lap
        layout.notes.append(f"its {len(points)} points repeat after {lap}: a closed course of {lap} gates, {whole} "
                            f"whole laps; what is left of a lap ({rest} points) was left out")
    elif not closed:
        layout.laps = 1
    layout.closed = closed
    if track.find("end") is not None:
        layout.notes.append("the end point was left out: a race here ends at its last gate")
    _initial(track, layout)
    lap_points = np.array(points[:lap])
    layout.gates = [Gate(tuple(p), _through(track, lap_points, i, closed, layout.start_p_W, options.inclined))
                    for i, p in enumerate(lap_points)]
    layout.notes.append("the file has points, no gates: each is passed from the one before to the one after, " +
                        ("inclined as these lie (--inclined)" if options.inclined
                         else "by gates that stand upright (--inclined leans them)"))
    return layout


def _initial(track, layout):
    initial = track.find("initial") or track
    if initial.find("position") is None:
        return
    layout.start_p_W = initial.need("position").vector(3, "x, y, z in metres")
    attitude = initial.find("attitude")
    if attitude is not None:
        layout.start_yaw_rad = math.radians(yaw_deg(of_quaternion(attitude) @ (1, 0, 0)))


def _lap_length(points):
    """After how many points they repeat, from half of them on; all of them: they don't."""
    points = np.array(points)
    for lap in range(2, len(points) // 2 + 1):
        if np.abs(points[lap:] - points[:-lap]).max() < SAME_M:
            return lap
    return len(points)


def _through(track, points, i, closed, start, inclined):
    """The passing direction of point i."""
    count = len(points)
    before = points[i - 1] if i > 0 or closed else (points[0] if start is None else np.array(start))
    after = points[(i + 1) % count] if i + 1 < count or closed else points[i]
    way = np.array(after - before, float)
    if not inclined:
        way[2] = 0.0
    if np.linalg.norm(way) < 0.01:
        track.need("gates").nodes()[i].refuse("neighbours that are not above each other, or --inclined: "
                                              "the way through is said by nothing else")
    return tuple(way / np.linalg.norm(way))
