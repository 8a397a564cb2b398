"""Client of a Gatefield planning server: send depth images and states, get plans back.

    import gatefield

    with gatefield.connect("circle", timing="lockstep") as drone:
        drone.send_depth(stamp, depth)                  # (90, 160), uint16 millimetres or float32 metres
        sequence = drone.send_state(stamp, state)       # a gatefield.State
        drone.wait_for_answer(sequence)
        setpoint = drone.play(stamp, state, period=10_000_000)

Frames: world ENU, z up; body FLU; camera optical. SI units. Stamps and periods are integers, nanoseconds.
"""

from ._process import require_main_interpreter

require_main_interpreter()  # before the extension, whose set-up would wait for the main interpreter's lock for ever

from . import _gatefield

from ._gatefield import (IdentifiedDrive, Plan, PlannerHealth, Problem, ProblemChange, Server, Session, SessionChange,
                         Setpoint, Statistics, Telemetry)
from .client import Client, State, connect, find_servers, nanoseconds, now
from .errors import Busy, Invalid, NoAnswer, Refused, UnknownName, Unreadable, Unsupported, WrongVersion
from .options import (Actuation, Camera, Course, GateShape, Network, Quadrotor, Track, Vehicle, Waypoint,
                      forward_camera_mount)

__version__ = _gatefield.__version__

__all__ = [
    "Actuation", "Busy", "Camera", "Client", "Course", "GateShape", "IdentifiedDrive", "Invalid", "Network", "NoAnswer",
    "Plan", "PlannerHealth", "Problem", "ProblemChange", "Quadrotor", "Refused", "Server", "Session", "SessionChange",
    "Setpoint", "State", "Statistics", "Telemetry", "Track", "UnknownName", "Unreadable", "Unsupported", "Vehicle",
    "Waypoint", "WrongVersion", "connect", "find_servers", "forward_camera_mount", "nanoseconds", "now"
]
