"""The client: joins a session, sends state and depth, gets plans, plays them out."""

import atexit
import time
import weakref
from dataclasses import dataclass, field
from os import PathLike
from typing import Any, List, Optional, Union

import numpy as np

from . import _gatefield
from ._gatefield import Plan, Problem, ProblemChange, Server, Session, SessionChange, Setpoint, Statistics, Telemetry
from .options import Course, Name, Network, Options, Vehicle


def nanoseconds(seconds: float) -> int:
    """Seconds as the integer that stamps and periods are, rounded to the nearest one."""
    return round(seconds * 1e9)


def now() -> int:
    """The machine's monotonic clock, nanoseconds: the stamps of a vehicle in real time (`time.monotonic_ns()`)."""
    return time.monotonic_ns()


def _zeros(count: int) -> Any:
    return field(default_factory=lambda: np.zeros(count))


@dataclass
class State:
    """The rigid body and its rotors. W is ENU, z up; B is FLU.

    p_WB: position of B's origin, the centre of mass, in W, m, shape (3,).
    v_WB: its velocity in W (not in B), m/s, shape (3,).
    q_WB_wxyz: attitude, body to world, in the order w, x, y, z, shape (4,). SciPy and ROS have x, y, z, w.
    w_WB_B: body rates about x, y, z of B, rad/s, shape (3,).
    thrust_n: what each rotor gives now, N, shape (4,); not read where thrust_known=False is sent.
    thrust_command_n: what each was asked for last (`Setpoint.rotor_thrust_n`, held), N, shape (4,).
    """

    p_WB: Any = _zeros(3)
    v_WB: Any = _zeros(3)
    q_WB_wxyz: Any = field(default_factory=lambda: np.array([1.0, 0.0, 0.0, 0.0]))
    w_WB_B: Any = _zeros(3)
    thrust_n: Any = _zeros(4)
    thrust_command_n: Any = _zeros(4)


class Client:
    """A session, made by `connect()`. As a context manager it leaves the session at the end of the block.

    Threads: every method may be called from everywhere, beside the others; `play()` and `applied()` take turns.
    Whatever waits or makes system calls lets other Python threads run. Ctrl-C ends a wait within 100 ms.

    The last plan is played out by itself, then the vehicle levels, holds and descends. A server that dies and returns
    is joined again without a call.
    """

    def __init__(self, joined: Any, options: Options) -> None:
        self._joined = joined
        self._options = options
        _living.add(self)

    def __enter__(self) -> "Client":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def __repr__(self) -> str:
        where = "closed" if self.closed else f"with {self.session.server}"
        return f"<gatefield.Client '{self._options.vehicle}' in domain {self._options.domain}, {where}>"

    def close(self) -> None:
        """Leaves the session. Closing twice does nothing."""
        self._joined.close()
        _living.discard(self)

    @property
    def closed(self) -> bool:
        return self._joined.closed

    @property
    def session(self) -> Session:
        """The accepted session: control_period_s, plan_step_s, server."""
        return self._joined.session()

    def send_depth(self, stamp: int, depth: Any) -> int:
        """Sends a depth image: along the optical axis, 0 = no return.

        stamp: middle of the exposure, nanoseconds, of the same clock in every call.
        depth: shape (height, width) of the camera, or that with a last axis of 1, or flat. uint16: counts of
            `Camera.metres_per_count`; float32: metres. Both are taken as they lie when C-contiguous; other orders and
            float64 are copied once. Other types are refused.
        Returns the frame's sequence number.
        """
        return self._joined.send_depth(stamp, depth)

    def send_state(self, stamp: int, state: State, thrust_known: bool = True) -> int:
        """Sends where the vehicle is. Returns the state's sequence number.

        thrust_known: state.thrust_n is measured or estimated; else the server models it.
        """
        return self._joined.send_state(stamp, state, thrust_known)

    def newest(self) -> Optional[Plan]:
        """The newest plan, once; None when there is no newer one than last time."""
        return self._joined.newest()

    def wait_for_answer(self, sequence: int, timeout_s: float = 2.0) -> Optional[Plan]:
        """Lockstep: waits for the plan that answers this state, which is sent again meanwhile. None: not in time."""
        return self._joined.wait_for_answer(sequence, timeout_s)

    def play(self, now: int, state: State, period: int) -> Setpoint:
        """What to ask the vehicle for from `now` until the next call: the plan, or the fallback when it has run out.

        period: until the next call, nanoseconds, 0 to 100 ms (clamped).
        Rotor thrusts are reached at now + period: apply them at once and hold them. For a vehicle of body rates
        collective thrust and body rates are commands that hold from now on.
        """
        return self._joined.play(now, state, period)

    def applied(self, now: int, setpoint: Optional[Setpoint]) -> None:
        """Vehicles of body rates: what the vehicle is asked for from `now` on where that is not what play() said.

        None: nobody here knows. Called by who calls play(), after it.
        """
        self._joined.applied(now, setpoint)

    def problems(self) -> List[Problem]:
        """What the server says is wrong now."""
        return self._joined.problems()

    def problem_changes(self) -> List[ProblemChange]:
        """What began or ended to be wrong since the last call, in order; of more than 64 the oldest are lost."""
        return _until_none(self._joined.problem_change)

    def session_changes(self) -> List[SessionChange]:
        """What became of the session since the last call, in order; of more than 64 the oldest are lost."""
        return _until_none(self._joined.session_change)

    def statistics(self) -> Statistics:
        """Commands, losses and round trips since connect()."""
        return self._joined.statistics()

    def telemetry(self) -> Optional[Telemetry]:
        """The newest telemetry, if any came since the last call."""
        return self._joined.telemetry()


def connect(
    course: Union[Course, Name],
    *,
    model: Union[Vehicle, Name, None] = None,
    vehicle: str = "drone",
    domain: int = 0,
    timing: str = "real_time",
    profile: str = "race",
    seed: int = 1,
    speed_limit_m_s: float = 0.0,
    priority: int = 5,
    server: str = "",
    timeout_s: float = 5.0,
    network: Optional[Network] = None,
) -> Client:
    """Joins a planning server; waits until one accepts, refuses, or the timeout passes.

    course: what is flown; a path or short name loads a course file.
    model: the vehicle's quadrotor, actuation and camera (default: the SDK's); a path or short name loads a vehicle
        file.
    vehicle: name on the wire, [A-Za-z0-9_.-]; one client per name.
    domain: DDS domain, 0 to 232.
    timing: "real_time": the server plans at its control rate. "lockstep": it answers every state exactly once, after
        the depth frame that was sent before it; for simulators.
    profile: planner profile of the server.
    seed: of the planner's sampling.
    speed_limit_m_s: soft cap on speed; 0: the profile's.
    priority: 0 to 9; who has least is refused or sent away first when a server can't serve all.
    server: only the one of this name may answer; "": whichever is first.
    network: peers, interfaces, discovery servers, shared memory, security.

    Raises Refused: Invalid with the field, UnknownName, Busy (asked again until the timeout), NoAnswer, and others.
    """
    model = Vehicle() if model is None else model if isinstance(model, Vehicle) else Vehicle.load(model)
    course = Course.load(course) if isinstance(course, (str, PathLike)) else course
    options = Options(course, model.quadrotor, model.actuation, model.camera, vehicle, domain, timing, profile, seed,
                      speed_limit_m_s, priority, server, timeout_s, network or Network())
    return Client(_gatefield.connect(options), options)


def find_servers(domain: int = 0, wait_s: float = 1.0, network: Optional[Network] = None) -> List[Server]:
    """The servers of a domain that say within `wait_s` that they are there, by name.

    In a closed domain `network.security` is a tool's folder (gatefield-keys tool NAME).
    """
    return _gatefield.find_servers(domain, wait_s, network or Network())


def _until_none(question: Any) -> List[Any]:
    return list(iter(question, None))


# Sessions that are open when the program ends are left while Python still runs.
_living: "weakref.WeakSet[Client]" = weakref.WeakSet()


@atexit.register
def _leave_all() -> None:
    for client in list(_living):
        client.close()
