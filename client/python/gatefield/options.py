"""What a vehicle is and what it shall fly, as the server is told when joining.

Frames: W world, ENU, z up. B body, FLU: x forward, y left, z up. C camera, optical: x right, y down, z forward.
SI units; a name says its unit. The defaults are the SDK's: the 0.83 kg racer with its depth camera.
Vectors are tuples here; lists and NumPy arrays do as well. What is wrong is said by `connect()`, with the field's name.
"""

from dataclasses import dataclass, field
from os import PathLike
from pathlib import Path
from typing import Any, Optional, Sequence, Tuple, Union

from . import _gatefield

Vector = Sequence[float]
Name = Union[str, "PathLike[str]"]

_QUADROTOR = _gatefield.default_quadrotor()
_ACTUATION = _gatefield.default_actuation()
_CAMERA = _gatefield.default_camera()
_GATE = _gatefield.default_gate()


@dataclass
class Quadrotor:
    """Mass, rotors, limits. Rotors push along +z of B; their order is yours, and holds for all thrusts.

    inertia_kg_m2: principal moments about x, y, z of B, shape (3,).
    rotor_position_B_m: x and y of each rotor, shape (4, 2). Default: front right, rear left, front left, rear right.
    rotor_spin: sign of each rotor's reaction torque about +z, 1 or -1, shape (4,).
    torque_per_thrust_m: reaction torque over thrust.
    thrust_min_n, thrust_max_n, thrust_rate_max_n_s: of each rotor.
    rotor_time_constant_s: first-order lag of a rotor's thrust behind what it is asked for.
    drag_kg_s: linear drag in B, F_B = -diag(drag) v_B, shape (3,).
    collision_radius_m: of the sphere around the centre of mass that must not touch anything.
    body_rate_max_rad_s: most that may be asked for about x, y, z of B, shape (3,); 0: the planner's own limit.
    """

    mass_kg: float = _QUADROTOR["mass_kg"]
    inertia_kg_m2: Vector = _QUADROTOR["inertia_kg_m2"]
    rotor_position_B_m: Sequence[Vector] = _QUADROTOR["rotor_position_B_m"]
    rotor_spin: Sequence[int] = _QUADROTOR["rotor_spin"]
    torque_per_thrust_m: float = _QUADROTOR["torque_per_thrust_m"]
    thrust_min_n: float = _QUADROTOR["thrust_min_n"]
    thrust_max_n: float = _QUADROTOR["thrust_max_n"]
    thrust_rate_max_n_s: float = _QUADROTOR["thrust_rate_max_n_s"]
    rotor_time_constant_s: float = _QUADROTOR["rotor_time_constant_s"]
    drag_kg_s: Vector = _QUADROTOR["drag_kg_s"]
    collision_radius_m: float = _QUADROTOR["collision_radius_m"]
    body_rate_max_rad_s: Vector = _QUADROTOR["body_rate_max_rad_s"]


@dataclass
class Actuation:
    """How the vehicle is driven: by rotor thrusts, or by a flight controller that takes thrust and body rates.

    kind: "rotor_thrusts" or "body_rates".
    thrust_time_constant_s: body_rates: first-order lag of the collective thrust, 0.001 to 1; else 0.
    rate_time_constant_s: body_rates: of each body rate behind its command, about x, y, z of B, shape (3,); else 0.
    """

    kind: str = _ACTUATION["kind"]
    thrust_time_constant_s: float = _ACTUATION["thrust_time_constant_s"]
    rate_time_constant_s: Vector = _ACTUATION["rate_time_constant_s"]


@dataclass
class Camera:
    """A depth camera: pinhole, depth along the optical axis (not the ray's length), 0 = no return.

    fx_px, fy_px, cx_px, cy_px: of the image that is sent. The centre of pixel (column u, row v) is (u + 0.5, v + 0.5):
        add 0.5 to cx and cy of OpenCV or ROS. Default: 160 x 90, 87 x 58 deg, 15 deg up.
    min_depth_m, max_depth_m: what lies outside is no return.
    X_BC: mounting, shape (4, 4): maps points of C into B. `forward_camera_mount()` makes the usual one.
    metres_per_count: of images of uint16, 0.001 for millimetres.
    distortion_model: "none", or "brown_conrady" with k1, k2, p1, p2, k3. What moves a pixel by more than 1 is refused.
    """

    width_px: int = _CAMERA["width_px"]
    height_px: int = _CAMERA["height_px"]
    fx_px: float = _CAMERA["fx_px"]
    fy_px: float = _CAMERA["fy_px"]
    cx_px: float = _CAMERA["cx_px"]
    cy_px: float = _CAMERA["cy_px"]
    min_depth_m: float = _CAMERA["min_depth_m"]
    max_depth_m: float = _CAMERA["max_depth_m"]
    rate_hz: float = _CAMERA["rate_hz"]
    X_BC: Sequence[Vector] = _CAMERA["X_BC"]
    metres_per_count: float = _CAMERA["metres_per_count"]
    distortion_model: str = _CAMERA["distortion_model"]
    distortion: Vector = _CAMERA["distortion"]

    @classmethod
    def from_fov(cls, width_px: int, height_px: int, horizontal_rad: float, vertical_rad: float,
                 **other: Any) -> "Camera":
        """Of full fields of view, with the principal point in the middle; `other`: further arguments."""
        made = _gatefield.camera_from_fov(width_px, height_px, horizontal_rad, vertical_rad)
        return cls(**{**made, **other})


def forward_camera_mount(pitch_up_rad: float = 0.0, p_BC: Vector = (0.0, 0.0, 0.0)) -> Sequence[Vector]:
    """`Camera.X_BC` of a camera that looks along x of B, turned up by `pitch_up_rad`, at `p_BC` (B, m)."""
    return _gatefield.forward_camera_mount(pitch_up_rad, p_BC)


@dataclass
class GateShape:
    """A flat frame around an opening; the passing direction goes through it.

    opening: "square" or "round".
    inner_half_m: half-width of the opening, the radius of a round one.
    outer_half_m: half-width of the frame's outer edge.
    thickness_m: of the frame, along the passing direction.
    """

    opening: str = _GATE["opening"]
    inner_half_m: float = _GATE["inner_half_m"]
    outer_half_m: float = _GATE["outer_half_m"]
    thickness_m: float = _GATE["thickness_m"]


@dataclass
class Waypoint:
    """One passage of the course: about where a gate is, and which way it is flown through.

    p_W: nominal centre of the opening, W, m, shape (3,).
    direction_W: passing direction, unit, shape (3,); zero: it follows from the neighbours.
    gate: the gate's nominal shape.
    gate_id: waypoints of the same number other than 0 are passages of one physical gate.
    """

    p_W: Vector
    direction_W: Vector = (0.0, 0.0, 0.0)
    gate: GateShape = field(default_factory=GateShape)
    gate_id: int = 0


@dataclass
class Course:
    """What is flown, as the planner may know it: 1 to 64 nominal gates in their order. True places are nowhere in here.

    laps: 1 to 1000.
    closed: after the last waypoint of a lap comes the first one.
    floor_z_m: height of the floor in W, where it is known.
    """

    waypoints: Sequence[Waypoint]
    laps: int = 1
    closed: bool = True
    floor_z_m: Optional[float] = None

    @classmethod
    def load(cls, name: Name) -> "Course":
        """Of a course file, by its path or short name ("circle"). `Track.load()` gives the file's other content."""
        return Track.load(name).course


@dataclass
class Vehicle:
    """A quadrotor, how it is driven, and its camera: what a vehicle file has.

    notes: what was taken otherwise than the file has it, for the person whose file it is.
    """

    quadrotor: Quadrotor = field(default_factory=Quadrotor)
    actuation: Actuation = field(default_factory=Actuation)
    camera: Camera = field(default_factory=Camera)
    title: str = ""
    notes: Sequence[str] = ()

    @classmethod
    def load(cls, name: Name) -> "Vehicle":
        """Of a vehicle file, by its path or short name ("racer")."""
        made = _gatefield.load_vehicle(_shipped("vehicles", name))
        return cls(Quadrotor(**made["quadrotor"]), Actuation(**made["actuation"]), Camera(**made["camera"]),
                   made["title"], tuple(made["notes"]))


@dataclass
class Track:
    """A course file: the course, and what its simulator is told beside it.

    start_p_WB: where the vehicle starts, W, m, shape (3,).
    start_yaw_rad: heading there, about z of W from x of W.
    flight_volume: lower and upper corner in W, m.
    """

    course: Course
    start_p_WB: Vector
    start_yaw_rad: float
    flight_volume: Tuple[Vector, Vector]
    title: str = ""

    @classmethod
    def load(cls, name: Name) -> "Track":
        """Of a course file, by its path or short name ("circle")."""
        made = _gatefield.load_track(_shipped("courses", name))
        course = dict(made.pop("course"))
        waypoints = [Waypoint(**{**waypoint, "gate": GateShape(**waypoint["gate"])})
                     for waypoint in course.pop("waypoints")]
        return cls(Course(waypoints, **course), **made)


@dataclass
class Network:
    """Which ways into a DDS domain to take, where multicast on every interface is not right.

    peers: hosts that are called one by one: "10.0.0.7", "pit.example", "10.0.0.7:0-24".
    interfaces: to speak and listen on: "eth0", "10.0.0.5"; empty: all.
    discovery_servers: "10.0.0.7:11811"; others are found through them alone.
    shared_memory: beside UDP, for processes of one host and user.
    security: folder that `gatefield-keys` made for who takes part here, in a domain that is closed; "": it is open.
    """

    peers: Sequence[str] = ()
    interfaces: Sequence[str] = ()
    discovery_servers: Sequence[str] = ()
    shared_memory: bool = False
    security: str = ""


@dataclass
class Options:
    """All that `connect()` takes, as the extension reads it."""

    course: Course
    quadrotor: Quadrotor
    actuation: Actuation
    camera: Camera
    vehicle: str
    domain: int
    timing: str
    profile: str
    seed: int
    speed_limit_m_s: float
    priority: int
    server: str
    timeout_s: float
    network: Network


def _shipped(kind: str, name: Name) -> Name:
    """The file of a short name where the package has its own (as pip installs it); else the name."""
    inside = Path(__file__).parent / "config" / kind / f"{name}.txt"
    return inside if inside.is_file() else name


__all__ = ["Actuation", "Camera", "Course", "GateShape", "Network", "Quadrotor", "Track", "Vehicle", "Waypoint",
           "forward_camera_mount"]
