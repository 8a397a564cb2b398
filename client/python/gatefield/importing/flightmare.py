"""Vehicle parameters of flightmare and its kin (YAML, table quadrotor_dynamics)."""

import math

import numpy as np

from .source import read_yaml
from .vehicles import Body

# The rotors as the programs number them, with the sign of each one's torque about the body's z.
_NAMED = (("tbm_fr", -1), ("tbm_bl", -1), ("tbm_br", 1), ("tbm_fl", 1))
_BY_ARM = ((1, 1, 1), (1, -1, -1), (-1, -1, 1), (-1, 1, -1))


def read(path, options):
    root = read_yaml(path)
    table = root.find("quadrotor_dynamics") or root
    mass = table.need("mass").positive("a mass in kg above 0")
    fastest = table.need("motor_omega_max").positive("a speed above 0")
    c2, c1, c0 = table.need("thrust_map").vector(3, "three coefficients: of the speed's square, its own, and alone")
    thrust_max = c2 * fastest**2 + c1 * fastest + c0
    if thrust_max <= 0:
        table.need("thrust_map").refuse(f"coefficients that make a thrust above 0 at motor_omega_max, {fastest:g}")
    body = Body(f"flightmare, {path.stem}", mass, torque_per_thrust_m=table.need("kappa").positive("metres above 0"),
                thrust_max_n=thrust_max, rotor_time_constant_s=table.need("motor_tau").positive("seconds above 0"))
    body.notes.append("motor_tau is the lag of a rotor's speed; near hover its thrust has the same one")
    rates = table.find("omega_max")
    if rates is not None:
        body.body_rate_max_rad_s = rates.vector(3, "three rates in rad/s")
    _places(table, body)
    _drag(table, body, options)
    if root.find("rgb_camera") is not None:
        body.notes.append("its rgb_camera was not read: --camera says which depth camera there is")
    return body


def _places(table, body):
    """Rotors and inertia: named and told, or by the arm's length as older releases compute them."""
    inertia = table.find("inertia")
    if inertia is not None:
        body.inertia_kg_m2 = np.diag(inertia.vector(3, "three moments in kg m^2"))
    if table.find("tbm_fr") is not None:
        body.rotors = [(*table.need(name).vector(3, "x, y, z in metres")[:2], sign) for name, sign in _NAMED]
        return
    arm = table.need("arm_l", "tbm_fr")
    length = arm.positive("metres above 0")
    side = length * math.sqrt(0.5)
    body.rotors = [(x * side, y * side, sign) for x, y, sign in _BY_ARM]
    body.notes.append("rotors lie at 45 degrees at the end of arm_l, as the program has them")
    if inertia is None:
        body.inertia_kg_m2 = body.mass_kg / 12 * length**2 * np.diag([4.5, 4.5, 7.0])
        body.notes.append("the inertia is m / 12 arm_l^2 (4.5, 4.5, 7), as the program computes it (--inertia "
                          "says otherwise)")


def _drag(table, body, options):
    linear = table.find("body_drag_1")
    if linear is None:
        return
    body.drag_kg_s = tuple(abs(value) for value in linear.vector(3, "three coefficients"))
    cubic = table.find("body_drag_3")
    if cubic is None or not any(cubic.vector(3, "three coefficients")):
        return
    if options.drag_speed is None:
        body.drag_kg_s, body.drag_hint = None, "or --drag-speed V: its cubic drag is then taken at V m/s"
        return
    body.drag_kg_s = tuple(a + options.drag_speed**2 * abs(b)
                           for a, b in zip(body.drag_kg_s, cubic.vector(3, "three coefficients")))
    body.notes.append(f"body_drag_3 was taken at {options.drag_speed:g} m/s")
