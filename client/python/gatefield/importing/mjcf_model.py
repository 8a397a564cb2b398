"""What of MJCF stands between an element and its attributes: classes of defaults, angles, orientations."""

import math

import numpy as np

from .rotations import about, of_axis, of_quaternion
from .source import Node, attribute, label

_NOT_FOLLOWED = ("settotalmass", "boundmass", "boundinertia", "inertiagrouprange")  # they change masses
_ACTUATORS = ("general", "motor", "position", "velocity", "intvelocity", "damper", "cylinder", "muscle", "adhesion")


class Model:

    def __init__(self, path, root):
        self.path = path
        self.root = root
        if root.tag != "mujoco":
            Node(path, root.tag, "its root").refuse("<mujoco>")
        for element in root.iter():
            if element.tag in ("include", "attach", "replicate", "frame"):
                Node(path, element.tag, "an element of it").refuse(
                    "a model in one file without it: MuJoCo's `compile FILE.xml OUT.xml` writes one")
        self._compiler = {}
        for element in root.findall("compiler"):
            self._compiler.update(element.attrib)
        for name in _NOT_FOLLOWED:
            if name in self._compiler:
                Node(path, self._compiler[name], f"compiler.{name}").refuse("none: masses are not adapted here")
        self.from_geoms = self._compiler.get("inertiafromgeom", "auto") == "true"
        self._classes = {}
        for element in root.findall("default"):
            self._collect(element, element.get("class", "main"), {})

    label = staticmethod(label)

    def _collect(self, element, name, inherited):
        """Attributes by tag of a class and those in it."""
        own = {tag: dict(values) for tag, values in inherited.items()}
        for child in element:
            if child.tag != "default":
                own.setdefault(self._kind(child.tag), {}).update(child.attrib)
        self._classes[name] = own
        for child in element.findall("default"):
            self._collect(child, child.get("class", ""), own)

    @staticmethod
    def _kind(tag):
        return "general" if tag in _ACTUATORS else tag  # shortcuts share their defaults

    def _text(self, element, name, childclass=None):
        if name in element.attrib:
            return element.get(name)
        chosen = element.get("class", childclass or "main")
        return self._classes.get(chosen, {}).get(self._kind(element.tag), {}).get(name)

    def of(self, element, name, childclass=None):
        """The attribute as a Node, by the element or its class; None: nowhere said."""
        text = self._text(element, name, childclass)
        return None if text is None else attribute(self.path, type(element)(element.tag, {name: text}), name,
                                                   where=label(element))

    def need(self, element, name):
        node = self.of(element, name)
        if node is None:
            Node(self.path, None, label(element)).lacks(name, "expected one")
        return node

    def number(self, element, name, childclass, default):
        node = self.of(element, name, childclass)
        return default if node is None else node.number()

    def word(self, element, name, childclass, default):
        return self._text(element, name, childclass) or default

    def pose(self, element, _tag, childclass=None):
        """Rotation and translation in its parent."""
        place = self.of(element, "pos", childclass)
        return self._rotation(element, childclass), np.array(place.vector(3)) if place is not None else np.zeros(3)

    def _angle(self, value):
        return value if self._compiler.get("angle", "degree") == "radian" else math.radians(value)

    def _rotation(self, element, childclass):
        quaternion = self.of(element, "quat", childclass)
        if quaternion is not None:
            length = math.sqrt(sum(value * value for value in quaternion.vector(4)))  # MuJoCo takes any length
            return of_quaternion(Node(self.path, [v / length for v in quaternion.value] if length else quaternion.value,
                                      quaternion.path))
        euler = self.of(element, "euler", childclass)
        if euler is not None:
            R = np.eye(3)
            for axis, value in zip(self._compiler.get("eulerseq", "xyz"), euler.vector(3)):
                turn = about("xyz".index(axis.lower()), self._angle(value))
                R = R @ turn if axis.islower() else turn @ R
            return R
        axis = self.of(element, "axisangle", childclass)
        if axis is not None:
            *way, value = axis.vector(4)
            return of_axis(way, self._angle(value))
        axes = self.of(element, "xyaxes", childclass)
        if axes is not None:
            x, y = np.array(axes.vector(6)).reshape(2, 3)
            x = x / np.linalg.norm(x)
            y = y - x * (x @ y)
            y = y / np.linalg.norm(y)
            return np.column_stack([x, y, np.cross(x, y)])
        if self.of(element, "zaxis", childclass) is not None:
            self.of(element, "zaxis", childclass).refuse("quat, euler, axisangle or xyaxes in place of zaxis")
        return np.eye(3)

    def floating_body(self, name):
        """The body of that name, else the one with a free joint; and the childclass that it stands under."""
        found = []

        def walk(parent, childclass):
            for body in parent.findall("body"):
                floats = body.find("freejoint") is not None or any(
                    joint.get("type") == "free" for joint in body.findall("joint"))
                if body.get("name") == name if name else floats:
                    found.append((body, childclass))
                walk(body, body.get("childclass", childclass))

        for world in self.root.findall("worldbody"):
            walk(world, None)
        if len(found) != 1:
            names = [body.get("name") for body in self.root.iter("body")]
            Node(self.path, [body.get("name") for body, _ in found], "its bodies with a free joint").refuse(
                f"one, or --body NAME of {', '.join(map(str, names[:12]))}")
        return found[0]
