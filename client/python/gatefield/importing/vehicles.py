"""A vehicle as its source says it, and the vehicle file that this becomes with what the options add."""

from dataclasses import dataclass, field
from typing import List, Optional, Sequence, Tuple

import numpy as np

from gatefield.errors import Invalid
from gatefield.options import Quadrotor, Vehicle

from .cameras import mount_of
from .needs import Needs
from .text import camera_block, number, quadrotor_block, vehicle_text

GRAVITY_M_S2 = 9.81
UPRIGHT = 0.985  # cosine of 10 degrees


@dataclass
class Body:
    """What a source says of a quadrotor; None: nothing. SI units, body frame FLU, around the centre of mass."""

    title: str
    mass_kg: Optional[float] = None
    inertia_kg_m2: Optional[np.ndarray] = None  # 3x3
    rotors: Optional[List[Tuple[float, float, Optional[int]]]] = None  # x, y, spin; spin None: not said
    torque_per_thrust_m: Optional[float] = None
    thrust_min_n: float = 0.0
    thrust_max_n: Optional[float] = None
    rotor_time_constant_s: Optional[float] = None
    drag_kg_s: Optional[Sequence[float]] = None
    drag_hint: str = "N per m/s along x, y, z of the body"
    propeller_radius_m: Optional[float] = None
    body_rate_max_rad_s: Sequence[float] = (0.0, 0.0, 0.0)
    notes: List[str] = field(default_factory=list)


def _moments(path, body, needs):
    """The moments about the body's axes."""
    given = needs.given("inertia")
    if given is not None:
        return tuple(given)
    tensor = needs.take("inertia", body.inertia_kg_m2, "its inertia", "--inertia XX YY ZZ")
    if tensor is None:
        return None
    moments = tuple(float(value) for value in np.diag(tensor))
    largest = float(np.abs(tensor - np.diag(moments)).max())
    if largest > 0.1 * min(moments):
        raise Invalid(f"{path}: its products of inertia are up to {number(largest)} kg m^2 beside moments of "
                      f"{', '.join(map(number, moments))}, expected next to none, since the body's axes have to be the "
                      "principal ones: turn its frame, or give --inertia XX YY ZZ", "invalid", "inertia",
                      number(largest), "next to none", str(path))
    if largest > 1e-3 * min(moments):
        body.notes.append(f"products of inertia of up to {number(largest)} kg m^2 were left out")
    return moments


def _rotors(path, body, needs):
    """Four of (x, y, spin)."""
    given = needs.given("rotor")
    if given:
        rotors = [(x, y, int(sign)) for x, y, sign in given]
        if any(sign not in (1, -1) for _, _, sign in given):
            raise Invalid("--rotor has a sign other than 1 and -1, expected 1 for a reaction torque that turns the "
                          "body to the left, seen from above", "invalid", "--rotor")
    else:
        rotors = needs.take("rotor", body.rotors, "where its rotors are", "--rotor X Y SIGN four times")
    if rotors is None:
        return None
    if len(rotors) != 4:
        raise Invalid(f"{path} has {len(rotors)} rotors, expected 4: nothing else is flown here", "invalid", "rotors",
                      str(len(rotors)), "4", str(path))
    spins = needs.given("spins")
    if spins is None and any(sign is None for _, _, sign in rotors):
        order = ", ".join(f"({number(x)}, {number(y)})" for x, y, _ in rotors)
        spins = needs.take("spins", None, "which way its rotors turn", "--spins S S S S",
                           f"1 where the reaction turns the body to the left, else -1; in the order {order}")
        if spins is None:
            return None
    return [(x, y, sign if spins is None else int(spins[i])) for i, (x, y, sign) in enumerate(rotors)]


def vehicle_file(path, body, options, head):
    """The text of the vehicle file."""
    needs = Needs(path, options)
    mass = needs.take("mass", body.mass_kg, "its mass", "--mass KG")
    moments = _moments(path, body, needs)
    rotors = _rotors(path, body, needs)
    torque = needs.take("torque_per_thrust", body.torque_per_thrust_m, "a rotor's reaction torque per thrust",
                        "--torque-per-thrust M")
    thrust_max = needs.take("thrust_max", body.thrust_max_n, "what thrust a rotor gives at most", "--thrust-max N")
    rate = needs.take("thrust_rate_max", None, "how fast a rotor's thrust may be asked to change",
                      "--thrust-rate-max N_S", "N/s; the shipped racer has 3 times its largest thrust")
    lag = needs.take("time_constant", body.rotor_time_constant_s, "how fast a rotor's thrust follows",
                     "--time-constant S")
    drag = needs.take("drag", body.drag_kg_s, "its linear drag", "--drag X Y Z", body.drag_hint)
    radius = needs.take("collision_radius", None, "how large its body is, for contact", "--collision-radius M",
                        "a sphere around body and arms; propellers count apart")
    propeller = needs.given("propeller_radius")
    propeller = body.propeller_radius_m if propeller is None else propeller
    camera = needs.take("camera", None, "what depth camera it has", "--camera FILE",
                        "a vehicle file or a shipped vehicle whose camera it gets; gatefield-import ros, opencv or "
                        "realsense puts your own in its place")
    needs.check()
    if propeller is None:
        body.notes.append("no propeller_radius_m: the referee takes 0.8 of half of the way to the next rotor "
                          "(--propeller-radius)")
    model = Quadrotor(mass, moments, [(x, y) for x, y, _ in rotors], [sign for _, _, sign in rotors], torque,
                      body.thrust_min_n, thrust_max, rate, lag, tuple(drag), radius,
                      tuple(options.body_rate_max or body.body_rate_max_rad_s))
    lens = Vehicle.load(camera).camera
    return vehicle_text(head + body.notes + [f"the camera is that of {camera}"], options.title or body.title,
                        quadrotor_block(model, propeller), camera_block(lens, mount_of(lens.X_BC)))
