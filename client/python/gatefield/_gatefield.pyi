"""The extension over the SDK. Use the package `gatefield`, which gives all of this that people need."""

from typing import Any, Dict, List, Optional, Sequence, Tuple

import numpy as np
import numpy.typing as npt

__version__: str
WIRE_VERSION: int

class Problem:
    """What can be wrong with a flight, as the server sees it; an enumeration."""

    gate_not_seen: Problem
    few_effective_samples: Problem
    plan_not_finite: Problem
    plan_thrust_rate: Problem
    plan_thrust: Problem
    plan_body_rate: Problem
    velocity_against_motion: Problem
    thrust_against_motion: Problem
    rates_against_attitude: Problem
    states_look_ned: Problem
    quaternion_looks_w_first: Problem
    velocity_looks_body_frame: Problem
    rates_look_world_frame: Problem
    rotors_look_swapped: Problem
    mounting_looks_wrong: Problem
    depth_unit_looks_wrong: Problem
    stamps_jump: Problem
    depth_missing: Problem
    states_missing: Problem
    states_rejected: Problem
    frames_rejected: Problem
    delay_long: Problem
    deadlines_missed: Problem
    thrust_unlike_told: Problem
    rate_loop_unlike_told: Problem
    rate_limit_unlike_told: Problem
    @property
    def name(self) -> str: ...
    @property
    def value(self) -> int: ...
    @property
    def sentence(self) -> str:
        """What was found, and what to look at, for people."""

class Setpoint:
    """What to ask the vehicle for."""

    def __init__(self, *, collective_thrust_n: float, body_rates_rad_s: Sequence[float]) -> None: ...
    @property
    def source(self) -> str:
        """ "plan" or "fallback"."""
    @property
    def rotor_thrust_n(self) -> npt.NDArray[np.float64]:
        """Of each rotor, N, shape (4,): reached at now + period; apply at once and hold."""
    @property
    def thrust_rate_n_s(self) -> npt.NDArray[np.float64]:
        """For rotors that take a rate of thrust, N/s, shape (4,); ask at 200 Hz or more."""
    @property
    def collective_thrust_n(self) -> float:
        """Of all rotors together, along +z of B, N."""
    @property
    def body_rates_rad_s(self) -> npt.NDArray[np.float64]:
        """About x, y, z of B (FLU), rad/s, shape (3,)."""

class PlannerHealth:
    """How the planner is doing; travels with every plan."""

    @property
    def solve_time_s(self) -> float: ...
    @property
    def effective_samples(self) -> float:
        """1 / sum w^2 of the rollouts' weights."""
    @property
    def lowest_field_m(self) -> float:
        """Lowest Gate-SDF value along the plan."""
    @property
    def latent_age_s(self) -> float:
        """Age of the field in use; -1: none yet."""
    @property
    def state_age_s(self) -> float:
        """How far the state was predicted forward."""
    @property
    def target_waypoint(self) -> int:
        """Index into the course."""
    @property
    def lap(self) -> int:
        """From 0."""
    @property
    def course_done(self) -> bool: ...
    @property
    def degraded(self) -> bool:
        """Flying on prediction: input missing, late or rejected."""
    @property
    def problems(self) -> List[Problem]: ...

class Plan:
    """A plan of `steps` intervals of `step` ns from `start` on. Arrays are views of it, read-only."""

    @property
    def sequence(self) -> int: ...
    @property
    def answers_sequence(self) -> int:
        """The state that the plan starts from."""
    @property
    def answers_stamp(self) -> int:
        """That state's stamp, ns, the client's clock."""
    @property
    def start(self) -> int:
        """When the first interval begins, ns, the client's clock."""
    @property
    def step(self) -> int:
        """Length of an interval, ns."""
    @property
    def validity(self) -> int:
        """After start + validity the fallback flies, ns."""
    @property
    def steps(self) -> int: ...
    @property
    def stamps(self) -> npt.NDArray[np.int64]:
        """When each interval begins, ns, shape (steps,)."""
    @property
    def thrust_rate_n_s(self) -> npt.NDArray[np.float64]:
        """Of each rotor during each interval, shape (steps, 4)."""
    @property
    def rotor_thrust_n(self) -> npt.NDArray[np.float64]:
        """What each rotor is asked for at the end of each interval, shape (steps, 4)."""
    @property
    def collective_thrust_n(self) -> npt.NDArray[np.float64]:
        """The sum of these, shape (steps,); of a plan of body rates the command during the interval."""
    @property
    def body_rates_rad_s(self) -> npt.NDArray[np.float64]:
        """w_WB_B, FLU, shape (steps, 3): predicted at the end of each interval; of a plan of body rates the command."""
    @property
    def actuation(self) -> str:
        """ "rotor_thrusts" or "body_rates"."""
    @property
    def health(self) -> PlannerHealth: ...
    @property
    def isa(self) -> str:
        """Instruction set of the server's kernels."""

class ProblemChange:
    @property
    def problem(self) -> Problem: ...
    @property
    def began(self) -> bool:
        """False: it ended."""

class SessionChange:
    @property
    def kind(self) -> str:
        """ "lost": there is none, the fallback flies. "rejoined": there is one again. "taken_over": another server
        goes on with it."""
    @property
    def why(self) -> str:
        """Of a loss, the code: "busy_server", "leaving", "abandoned", "no_answer" (the server fell silent)."""
    @property
    def server(self) -> str:
        """That lost it; else who flies the vehicle now."""
    @property
    def sentence(self) -> str: ...

class Statistics:
    """Of the link. Round trips: state sent to plan received, by this machine's clock, of the last 4096."""

    @property
    def commands(self) -> int: ...
    @property
    def rejected(self) -> int: ...
    @property
    def reconnects(self) -> int: ...
    @property
    def take_overs(self) -> int: ...
    @property
    def packets_dropped(self) -> int: ...
    @property
    def round_trip_p50_s(self) -> float: ...
    @property
    def round_trip_p99_s(self) -> float: ...
    @property
    def longest_silence_s(self) -> float: ...
    @property
    def solve_p50_s(self) -> float: ...
    @property
    def solve_p99_s(self) -> float: ...

class IdentifiedDrive:
    """How a vehicle of body rates follows what it is asked for, as found in flight; 0: not known."""

    @property
    def thrust_factor(self) -> float: ...
    @property
    def rate_time_constant_s(self) -> npt.NDArray[np.float64]: ...
    @property
    def rate_limit_rad_s(self) -> npt.NDArray[np.float64]: ...

class Telemetry:
    @property
    def server_stamp(self) -> int:
        """The server's own clock, ns."""
    @property
    def health(self) -> PlannerHealth: ...
    @property
    def states_received(self) -> int: ...
    @property
    def states_rejected(self) -> int: ...
    @property
    def frames_received(self) -> int: ...
    @property
    def frames_rejected(self) -> int: ...
    @property
    def frames_invalid(self) -> int:
        """Taken, but nothing to see in them."""
    @property
    def commands_sent(self) -> int: ...
    @property
    def deadlines_missed(self) -> int: ...
    @property
    def encode_time_s(self) -> float: ...
    @property
    def identified(self) -> IdentifiedDrive: ...
    @property
    def last_code(self) -> str:
        """Of the newest sample that was rejected; the next four say more."""
    @property
    def last_field(self) -> str: ...
    @property
    def last_value(self) -> str: ...
    @property
    def last_expected(self) -> str: ...
    @property
    def last_reason(self) -> str:
        """The sentence; "": none was rejected."""
    @property
    def isa(self) -> str: ...

class Session:
    @property
    def server(self) -> str: ...
    @property
    def number(self) -> int: ...
    @property
    def control_period_s(self) -> float: ...
    @property
    def plan_step_s(self) -> float: ...
    @property
    def plan_steps(self) -> int: ...
    @property
    def model_hash(self) -> str: ...

class Server:
    @property
    def name(self) -> str: ...
    @property
    def accepts(self) -> bool:
        """Takes newcomers at all."""
    @property
    def sessions(self) -> int: ...
    @property
    def room_cores(self) -> float:
        """What newcomers may take."""
    @property
    def isa(self) -> str: ...
    @property
    def model_hash(self) -> str: ...
    @property
    def wire_version(self) -> int: ...

class Client:
    @property
    def closed(self) -> bool: ...
    def close(self) -> None: ...
    def session(self) -> Session: ...
    def send_depth(self, stamp: int, depth: Any) -> int: ...
    def send_state(self, stamp: int, state: Any, thrust_known: bool) -> int: ...
    def newest(self) -> Optional[Plan]: ...
    def wait_for_answer(self, sequence: int, timeout_s: float) -> Optional[Plan]: ...
    def play(self, now: int, state: Any, period: int) -> Setpoint: ...
    def applied(self, now: int, setpoint: Optional[Setpoint]) -> None: ...
    def problems(self) -> List[Problem]: ...
    def problem_change(self) -> Optional[ProblemChange]: ...
    def session_change(self) -> Optional[SessionChange]: ...
    def statistics(self) -> Statistics: ...
    def telemetry(self) -> Optional[Telemetry]: ...

def connect(options: Any) -> Client: ...
def find_servers(domain: int, wait_s: float, network: Any) -> List[Server]: ...
def load_vehicle(name: Any) -> Dict[str, Any]: ...
def load_track(name: Any) -> Dict[str, Any]: ...
def config_folder() -> str: ...
def default_quadrotor() -> Dict[str, Any]: ...
def default_actuation() -> Dict[str, Any]: ...
def default_camera() -> Dict[str, Any]: ...
def default_gate() -> Dict[str, Any]: ...
def camera_from_fov(width_px: int, height_px: int, horizontal_rad: float, vertical_rad: float) -> Dict[str, Any]: ...
def forward_camera_mount(pitch_up_rad: float, p_BC: Any) -> Tuple[Tuple[float, ...], ...]: ...
