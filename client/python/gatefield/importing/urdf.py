"""Quadrotors in URDF: links put together at their joints' zero, rotors by their links.

Understood beside plain URDF: <properties> of gym-pybullet-drones, and the motor plugins of RotorS and Gazebo.
"""

import numpy as np

from gatefield.errors import Invalid

from .rigid import Part, together
from .rotations import of_rpy
from .source import Node, attribute, label, read_xml
from .vehicles import GRAVITY_M_S2, UPRIGHT, Body


def _vector(path, element, name, where):
    node = attribute(path, element, name, "0 0 0", where) if element is not None else None
    return np.array(node.vector(3)) if node is not None else np.zeros(3)


def _origin(path, element):
    """Rotation and translation of an element's <origin>."""
    origin = element.find("origin")
    where = f"{label(element)}.origin"
    return of_rpy(_vector(path, origin, "rpy", where)), _vector(path, origin, "xyz", where)


def _inertial(path, link, R, p):
    """The link's Part in the root's frame; None without a mass."""
    inertial = link.find("inertial")
    if inertial is None or inertial.find("mass") is None:
        return None
    where = f"{label(link)}.inertial"
    told = attribute(path, inertial.find("mass"), "value", "", f"{where}.mass")
    mass = told.number(0, what="a mass in kg of 0 or more")
    R_own, p_own = _origin(path, inertial)
    element = inertial.find("inertia")

    def moment(name):
        return attribute(path, element, name, "0", f"{where}.inertia").number() if element is not None else 0.0

    xx, xy, xz, yy, yz, zz = (moment(name) for name in ("ixx", "ixy", "ixz", "iyy", "iyz", "izz"))
    turned = R @ R_own
    return Part(mass, p + R @ p_own, turned @ np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]) @ turned.T)


def _frames(path, robot):
    """Rotation and translation of each link in the root link's frame, at the joints' zero."""
    links = {link.get("name"): link for link in robot.findall("link")}
    joints = []
    for joint in robot.findall("joint"):
        ends = [joint.find(tag).get("link") if joint.find(tag) is not None else None for tag in ("parent", "child")]
        if ends[0] not in links or ends[1] not in links:
            Node(path, ends, label(joint)).refuse("a parent and a child that are links of the file")
        joints.append((joint, *ends))
    roots = [name for name in links if all(name != child for _, _, child in joints)]
    if len(roots) != 1:
        Node(path, sorted(map(str, roots)), "its links").refuse("one link that is nobody's child, the body")
    frames = {roots[0]: (np.eye(3), np.zeros(3))}
    for _ in joints:
        for joint, parent, child in joints:
            if parent in frames and child not in frames:
                (R, p), (R_own, p_own) = frames[parent], _origin(path, joint)
                frames[child] = (R @ R_own, p + R @ p_own)
    return links, frames, {child: joint for joint, _, child in joints}


def _rotor_links(path, links, options):
    if options.rotors:
        for name in options.rotors:
            if name not in links:
                Node(path, name, "--rotors").refuse(f"links of the file: {', '.join(map(str, list(links)[:12]))}")
        return options.rotors
    names = [name for name in links if "prop" in str(name).lower() or "rotor" in str(name).lower()]
    if len(names) != 4 and not options.rotor:
        Node(path, names, "its links named prop or rotor").refuse("four, or --rotors NAME NAME NAME NAME")
    return names


def _places(path, names, parts, frames, joints, centre):
    """x, y of each rotor around the centre of mass: a turning link's joint, a fixed link's own centre of mass."""
    places = []
    for name in names:
        R, p = frames[name]
        turns = name in joints and joints[name].get("type") in ("continuous", "revolute")
        place = p if turns or name not in parts else parts[name].centre
        axis = R @ _vector(path, joints[name].find("axis"), "xyz", f"{label(joints[name])}.axis") if turns else R[:, 2]
        norm = np.linalg.norm(axis)
        if norm and abs(axis[2]) < UPRIGHT * norm:
            Node(path, [round(float(value), 3) for value in axis / norm], f"link '{name}'s axis").refuse(
                "one along z of the body, within 10 degrees")
        places.append((place - centre)[:2])
    return [(float(x), float(y)) for x, y in places]


def _motors(path, robot, names, joints, body):
    """Spins, thrusts and lags by the motor plugins of RotorS and Gazebo, where there are four."""
    by_joint = {}
    for plugin in robot.iter("plugin"):
        if plugin.find("motorConstant") is not None and plugin.find("jointName") is not None:
            by_joint[plugin.findtext("jointName").strip()] = plugin
    plugins = [by_joint.get(joints[name].get("name")) if name in joints else None for name in names]
    if not plugins or any(plugin is None for plugin in plugins):
        return None

    def told(key, what):
        texts = [type(plugin)("plugin", {key: plugin.findtext(key, "")}) for plugin in plugins]
        values = [attribute(path, text, key).positive(what) for text in texts]
        if max(values) - min(values) > 0.01 * max(values):
            Node(path, values, f"plugin.{key}").refuse("the same of all four: rotors here are alike")
        return values[0]

    body.torque_per_thrust_m = told("momentConstant", "metres above 0")
    body.thrust_max_n = told("motorConstant", "a number above 0") * told("maxRotVelocity", "rad/s above 0")**2
    body.rotor_time_constant_s = told("timeConstantUp", "seconds above 0")
    body.notes.append("thrusts, spins and lag (timeConstantUp) are those of its motor plugins; turning ccw drives the "
                      "body cw")
    spins = []
    for plugin in plugins:
        turning = plugin.findtext("turningDirection", "").strip()
        if turning not in ("cw", "ccw"):
            Node(path, turning, "plugin.turningDirection").refuse("cw or ccw")
        spins.append(1 if turning == "cw" else -1)
    return spins


def _properties(path, robot, body):
    """<properties kf km thrust2weight> of gym-pybullet-drones."""
    element = robot.find("properties")
    if element is None:
        return
    kf, km, ratio = (attribute(path, element, name) for name in ("kf", "km", "thrust2weight"))
    if kf is not None and km is not None:
        body.torque_per_thrust_m = km.positive("above 0") / kf.positive("above 0")
    if ratio is not None:
        body.thrust_max_n = ratio.positive("above 0") * body.mass_kg * GRAVITY_M_S2 / 4
    body.notes.append("thrust and torque are those of <properties> (thrust2weight, km / kf); its drag was not read")


def read(path, options):
    robot = read_xml(path)
    if robot.tag != "robot":
        Node(path, robot.tag, "its root").refuse("<robot> (a xacro file: expand it first, `xacro FILE > robot.urdf`)")
    links, frames, joints = _frames(path, robot)
    parts = {name: _inertial(path, links[name], *frames[name]) for name in frames}
    parts = {name: part for name, part in parts.items() if part is not None}
    whole = together(list(parts.values()))
    if whole is None:
        raise Invalid(f"{path} has no link with a mass, expected <inertial> with <mass> and <inertia>", "invalid",
                      "inertial", file=str(path))
    body = Body(f"URDF, {robot.get('name') or path.stem}", whole.mass_kg, whole.inertia)
    names = _rotor_links(path, links, options)
    places = _places(path, names, parts, frames, joints, whole.centre)
    spins = _motors(path, robot, names, joints, body)
    if spins is None:
        _properties(path, robot, body)
    body.rotors = [(x, y, None if spins is None else spins[i]) for i, (x, y) in enumerate(places)]
    body.notes.append(f"rotors: {', '.join(names)}; the body's axes were taken for x forward, y left, z up (REP 103)")
    return body
