"""Vehicle parameters of rotorpy: a Python file with a dictionary, of which only literals and arithmetic are read."""

import ast
import math

import numpy as np

from gatefield.errors import Unreadable

from .source import Node, content
from .vehicles import GRAVITY_M_S2, Body

_FUNCTIONS = {"sqrt": math.sqrt, "sin": math.sin, "cos": math.cos, "deg2rad": math.radians, "radians": math.radians}
_CONSTANTS = {"pi": math.pi}
_OPERATIONS = {ast.Add: lambda a, b: a + b, ast.Sub: lambda a, b: a - b, ast.Mult: lambda a, b: a * b,
               ast.Div: lambda a, b: a / b, ast.Pow: lambda a, b: a**b}


class _Reader:
    """Evaluates assignments of a module: numbers, text, lists, dictionaries, arrays, + - * / **, and a few functions.

    Numbers are floats and arrays are of floats, so that nothing grows beyond its text. Nothing else is ever called.
    """

    def __init__(self, path):
        self._path = path
        self.names = {}

    def read(self):
        try:
            module = ast.parse(content(self._path))
        except (SyntaxError, ValueError, RecursionError, MemoryError) as error:
            raise Unreadable(f"{self._path} is no Python: {error}", "unreadable", file=str(self._path)) from None
        for statement in module.body:
            if isinstance(statement, ast.Assign) and len(statement.targets) == 1 and \
                    isinstance(statement.targets[0], ast.Name):
                try:
                    self.names[statement.targets[0].id] = self._value(statement.value)
                except (ArithmeticError, ValueError, TypeError, RecursionError) as error:
                    raise self._refuse(statement, f"can't be computed ({error})") from None
        return self.names

    def _refuse(self, node, why):
        return Unreadable(f"{self._path}:{node.lineno}: {why}, expected numbers, lists, dictionaries and arithmetic: "
                          "other code is not run", "unreadable", file=str(self._path), line=node.lineno)

    def _value(self, node):
        if isinstance(node, ast.Constant) and isinstance(node.value, (int, float)) and not isinstance(node.value, bool):
            return float(node.value)
        if isinstance(node, ast.Constant):
            return node.value
        if isinstance(node, (ast.List, ast.Tuple)):
            return [self._value(item) for item in node.elts]
        if isinstance(node, ast.Dict) and all(key is not None for key in node.keys):
            return {str(self._value(key)): self._value(value) for key, value in zip(node.keys, node.values)}
        if isinstance(node, ast.Name) and node.id in self.names:
            return self.names[node.id]
        if isinstance(node, ast.UnaryOp) and isinstance(node.op, (ast.USub, ast.UAdd)):
            value = self._computable(node, self._value(node.operand))
            return -value if isinstance(node.op, ast.USub) else value
        if isinstance(node, ast.BinOp) and type(node.op) in _OPERATIONS:
            left = self._computable(node, self._value(node.left))
            return _OPERATIONS[type(node.op)](left, self._computable(node, self._value(node.right)))
        if isinstance(node, ast.Attribute) and self._is_library(node) and node.attr in _CONSTANTS:
            return _CONSTANTS[node.attr]
        if isinstance(node, ast.Call) and len(node.args) == 1 and isinstance(node.func, ast.Attribute) and \
                self._is_library(node.func):
            if node.func.attr in ("array", "asarray"):
                return np.array(self._value(node.args[0]), dtype=float)
            if node.func.attr in _FUNCTIONS:
                return _FUNCTIONS[node.func.attr](self._value(node.args[0]))
        raise self._refuse(node, f"has {ast.get_source_segment(content(self._path), node) or 'code'!r}"[:120])

    def _computable(self, node, value):
        if not isinstance(value, (float, np.ndarray)):
            raise self._refuse(node, "computes with what is no number")
        return value

    @staticmethod
    def _is_library(node):
        return isinstance(node.value, ast.Name) and node.value.id in ("np", "numpy", "math")


def _plain(value):
    """Without arrays, as Node has it."""
    if isinstance(value, np.ndarray):
        return value.tolist()
    if isinstance(value, dict):
        return {key: _plain(item) for key, item in value.items()}
    return value


def read(path, options):
    names = _Reader(path).read()
    tables = {name: value for name, value in names.items() if isinstance(value, dict) and "rotor_pos" in value}
    name = "quad_params" if "quad_params" in tables else next(iter(tables), None)
    if name is None:
        Node(path, None).lacks("dictionary with 'mass' and 'rotor_pos'", "expected one as rotorpy's quad_params")
    table = Node(path, _plain(tables[name]), name)

    mass = table.need("mass").positive("a mass in kg above 0")
    xx, yy, zz = (table.need(key).positive("a moment in kg m^2 above 0") for key in ("Ixx", "Iyy", "Izz"))
    xy, yz, xz = (table.find(key).number() if table.find(key) is not None else 0.0 for key in ("Ixy", "Iyz", "Ixz"))
    places = table.need("rotor_pos")
    if not isinstance(places.value, dict):
        places.refuse("a dictionary of places")
    directions = table.need("rotor_directions").vector(len(places.value), f"{len(places.value)} signs")
    rotors = []
    for (key, _), direction in zip(places.value.items(), directions):
        x, y, _ = places.need(key).vector(3, "x, y, z in metres")
        if direction not in (1.0, -1.0):
            table.need("rotor_directions").refuse("signs, 1 or -1 each")
        rotors.append((x, y, int(direction)))
    k_eta = table.need("k_eta").positive("a thrust coefficient above 0")
    k_m = table.need("k_m").positive("a torque coefficient above 0")
    fastest = table.need("rotor_speed_max").positive("a speed in rad/s above 0")
    slowest = table.need("rotor_speed_min").number(0, fastest, "a speed in rad/s of 0 to rotor_speed_max")
    radius = table.find("rotor_radius")
    inertia = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    body = Body(f"rotorpy, {path.stem}", mass, inertia, rotors, k_m / k_eta, k_eta * slowest**2,
                k_eta * fastest**2, table.need("tau_m").positive("seconds above 0"),
                propeller_radius_m=radius.positive("a radius in metres above 0") if radius is not None else None)
    body.notes.append("tau_m is the lag of a rotor's speed; near hover its thrust has the same one")
    _drag(table, body, k_eta, options)
    return body


def _drag(table, body, k_eta, options):
    """Linear: that of the rotors at their speed of hover, and the body's quadratic one at --drag-speed."""

    def told(key):
        node = table.find(key)
        return node.number(0, what="a coefficient of 0 or more") if node is not None else 0.0

    hover = math.sqrt(body.mass_kg * GRAVITY_M_S2 / (4 * k_eta))
    linear = [4 * hover * told(key) for key in ("k_d", "k_d", "k_z")]
    square = [told(key) for key in ("c_Dx", "c_Dy", "c_Dz")]
    if any(square) and options.drag_speed is None:
        body.drag_hint = "or --drag-speed V: its quadratic drag is then taken at V m/s"
        return
    speed = options.drag_speed or 0.0
    body.drag_kg_s = tuple(a + speed * b for a, b in zip(linear, square))
    if options.drag is None:
        body.notes.append(f"drag is the rotors' (k_d, k_z) at their speed of hover, {hover:.4g} rad/s" +
                          (f", and c_D at {speed:g} m/s" if any(square) else ""))
