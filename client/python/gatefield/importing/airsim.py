"""Gate poses of AirSim and its racing labs, written down as JSON: NED, y of the gate through its opening.

The file is a list or a table of poses as the client's objects have them, each `{ "position": { "x_val", .. },
"orientation": { "w_val", .. } }`, with "scale" where simGetObjectScale() was written down too. A table goes by the
number in its names: Gate2_5 is gate 2.
"""

import re

import numpy as np

from .courses import Gate, Layout
from .rotations import FLIP, of_quaternion
from .source import Node, read_json


def _values(node, letters):
    return tuple(node.need(f"{letter}_val").number(what="a finite number, as AirSim gives it once the gate has loaded")
                 for letter in letters)


def _ordered(table):
    """The nodes of a table of gates, by number."""
    names = [name for name in table.value if isinstance(table.value[name], dict)]
    numbered = []
    for name in names:
        found = re.match(r"\D*(\d+)", str(name))
        if not found:
            table.need(name).refuse("a name with the gate's number, Gate3 or Gate3_7")
        numbered.append((int(found[1]), name))
    if len({index for index, _ in numbered}) < len(numbered):
        table.refuse("names whose numbers differ")
    return [table.need(name) for _, name in sorted(numbered)]


def read(path, _options):
    root = read_json(path)
    start = root.find("start", "drone")
    table = root.find("gates", "gate_poses") or root
    if table is root and start is not None:
        table = Node(path, {key: value for key, value in root.value.items() if key not in ("start", "drone")})
    nodes = table.nodes() if isinstance(table.value, list) else _ordered(table) if isinstance(table.value, dict) else []
    if not nodes:
        table.refuse("a list or a table of gate poses")
    gates = []
    for node in nodes:
        p_W, R_WG = _pose(node)
        scale = node.find("scale")
        factor = 1.0
        if scale is not None:
            x, _, z = _values(scale, "xyz")
            if x <= 0 or abs(x - z) > 0.01 * abs(x):
                scale.refuse("the same scale in x and z, above 0: openings here are as wide as high")
            factor = x
        gates.append(Gate(p_W, R_WG=R_WG, scale=factor))
    layout = Layout(f"AirSim, {path.stem}", gates, gate_axis="y", notes=["positions and rotations were read as NED"])
    if any(gate.scale != 1 for gate in gates):
        layout.notes.append("--opening and --frame are those of a gate of scale 1; each gate's own scale multiplies "
                            "them")
    if start is not None:
        layout.start_p_W, R_WB = _pose(start)
        layout.start_yaw_rad = float(np.arctan2(R_WB[1, 0], R_WB[0, 0]))
    return layout


def _pose(node):
    """Position in W, and rotation to W from the axes of the thing as AirSim has them (FRD)."""
    p_ned = _values(node.need("position"), "xyz")
    orientation = node.need("orientation")
    R_ned = of_quaternion(Node(node.file, list(_values(orientation, "wxyz")), orientation.path))
    return tuple(FLIP @ p_ned), FLIP @ R_ned
