"""Quadrotors in MuJoCo's MJCF: the body that floats, what is fixed to it, and its four thrust actuators."""

import math

import numpy as np

from .mjcf_model import Model
from .rigid import Part, of_shape, together, volume
from .source import Node, read_xml
from .vehicles import UPRIGHT, Body

_AXES = {"sphere": 1, "capsule": 2, "cylinder": 2, "ellipsoid": 3, "box": 3}


def _inertial(model, element, R, p):
    R_own, p_own = model.pose(element, "inertial")
    mass = model.need(element, "mass").number(0, what="a mass in kg of 0 or more")
    full = model.of(element, "fullinertia")
    if full is not None:
        xx, yy, zz, xy, xz, yz = full.vector(6, "six moments")
        tensor = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    else:
        tensor = np.diag(model.need(element, "diaginertia").vector(3, "three moments"))
    turned = R @ R_own
    return Part(mass, p + R @ p_own, turned @ tensor @ turned.T)


def _geom(model, element, childclass, R, p):
    """The Part of a geom; None of one without mass."""
    kind = model.word(element, "type", childclass, "sphere")
    told = model.of(element, "mass", childclass)
    if told is not None and told.number(0, what="a mass in kg of 0 or more") == 0:
        return None
    if kind in ("plane", "hfield"):
        return None
    if kind not in _AXES:
        Node(model.path, kind, f"{model.label(element)}.type").refuse(
            f"{', '.join(_AXES)}, a mass of 0, or <inertial> in its body: the mass of others is not computed here")
    R_own, p_own = model.pose(element, "geom", childclass)
    ends = model.of(element, "fromto", childclass)
    size_node = model.of(element, "size", childclass)
    if size_node is None:
        Node(model.path, element.get("name"), model.label(element)).lacks("size", "expected one")
    size = size_node.value if isinstance(size_node.value, list) else [size_node.number()]
    if ends is not None:
        a, b = np.array(ends.vector(6, "two points")).reshape(2, 3)
        p_own, length = (a + b) / 2, np.linalg.norm(b - a)
        if length <= 0:
            ends.refuse("two points that differ")
        z = (b - a) / length
        x = np.cross(z, np.eye(3)[int(np.argmin(np.abs(z)))])
        x /= np.linalg.norm(x)
        R_own = np.column_stack([x, np.cross(z, x), z])
        size = [size[0], length / 2] if _AXES[kind] == 2 else [size[0], size[0], length / 2]
    if len(size) < _AXES[kind] or any(not isinstance(v, float) or v <= 0 for v in size[:_AXES[kind]]):
        size_node.refuse(f"{_AXES[kind]} sizes above 0 of a {kind}")
    mass = told.number() if told is not None else \
        model.number(element, "density", childclass, 1000.0) * volume(kind, size)
    turned = R @ R_own
    return Part(mass, p + R @ p_own, turned @ of_shape(kind, mass, size[:_AXES[kind]]) @ turned.T)


def _walk(model, body, childclass, R, p, parts, sites):
    """Collects parts and sites of a body and all below it."""
    childclass = body.get("childclass", childclass)
    inertial = body.find("inertial")
    if inertial is not None and not model.from_geoms:
        parts.append(_inertial(model, inertial, R, p))
    else:
        parts += [part for part in (_geom(model, geom, childclass, R, p) for geom in body.findall("geom")) if part]
    for site in body.findall("site"):
        R_own, p_own = model.pose(site, "site", childclass)
        sites[site.get("name")] = (R @ R_own, p + R @ p_own)
    for child in body.findall("body"):
        R_own, p_own = model.pose(child, "body")
        _walk(model, child, childclass, R @ R_own, p + R @ p_own, parts, sites)


def _actuators(model, sites):
    """(place, thrust at most, torque about z per thrust, lag) of each actuator that pushes a site along z."""
    found = []
    for element in model.root.iterfind("actuator/*"):
        site = model.word(element, "site", None, "")
        if site not in sites:
            continue
        gear_node = model.of(element, "gear")
        gear = list(gear_node.value) if gear_node is not None and isinstance(gear_node.value, list) else [1.0]
        gear = (gear + [0.0] * 6)[:6]
        R, p = sites[site]
        force, torque = R @ gear[:3], R @ gear[3:]
        length = np.linalg.norm(force)
        if length == 0:
            continue  # a torque alone
        if force[2] < UPRIGHT * length:
            gear_node.refuse("a force along z of the body, within 10 degrees")
        control = model.of(element, "ctrlrange")
        if control is None:
            Node(model.path, element.get("name"), model.label(element)).lacks("ctrlrange", "expected one")
        gain = model.of(element, "gainprm")
        factor = 1.0 if gain is None or element.tag != "general" else (gain.value[0] if isinstance(gain.value, list)
                                                                         else gain.number())
        lag = model.of(element, "dynprm") if model.word(element, "dyntype", None, "none").startswith("filter") else None
        found.append((p, control.vector(2)[1] * factor * float(force[2]), float(torque[2] / force[2]),
                      None if lag is None else lag.value[0] if isinstance(lag.value, list) else lag.number()))
    return found


def _alike(model, name, values):
    if max(values) - min(values) > 0.01 * max(abs(value) for value in values):
        shown = [round(value, 9) for value in values]
        Node(model.path, shown, name).refuse("the same of all four: rotors here are alike")
    return values[0]


def read(path, options):
    model = Model(path, read_xml(path))
    element, childclass = model.floating_body(options.body)
    parts, sites = [], {}
    _walk(model, element, childclass, np.eye(3), np.zeros(3), parts, sites)
    whole = together(parts)
    if whole is None:
        Node(path, element.get("name"), "its body").lacks("mass", "expected <inertial> or geoms with mass")
    body = Body(f"MJCF, {element.get('name') or path.stem}", whole.mass_kg, whole.inertia)
    body.notes.append("the body's axes were taken for x forward, y left, z up")
    if model.root.find("option") is not None and model.root.find("option").get("density"):
        body.drag_hint = "N per m/s; MuJoCo's drag in its medium is none that is linear"
    actuators = _actuators(model, sites)
    if len(actuators) != 4:
        if not options.rotor:
            Node(path, [element.get("name") for element in model.root.iterfind("actuator/*")], "its actuators").refuse(
                "four that push a site along z each (gear 0 0 1 0 0 TORQUE), or --rotor X Y SIGN four times")
        return body
    body.thrust_max_n = _alike(model, "thrusts of its actuators", [thrust for _, thrust, _, _ in actuators])
    ratio = _alike(model, "torques per thrust of its actuators", [abs(torque) for _, _, torque, _ in actuators])
    body.torque_per_thrust_m = ratio if ratio > 0 else None
    lags = [lag for _, _, _, lag in actuators]
    body.rotor_time_constant_s = None if None in lags else _alike(model, "dynprm of its actuators", lags)
    body.rotors = [(*map(float, (p - whole.centre)[:2]), int(math.copysign(1, torque)) if torque else None)
                   for p, _, torque, _ in actuators]
    return body
