"""What people write down, and what is said of it when it is wrong; without a server."""

import dataclasses
import pickle
from pathlib import Path

import numpy as np
import pytest

import gatefield
from gatefield import errors


def refused(**changes):
    """What connect() says, without anything being sent: such options leave no house."""
    with pytest.raises(gatefield.Invalid) as caught:
        gatefield.connect(changes.pop("course", gatefield.Course([gatefield.Waypoint((5, 0, 1.5), (1, 0, 0))])),
                          **changes)
    return caught.value


def test_a_bad_mass_is_refused_with_field_value_and_expectation():
    model = gatefield.Vehicle(gatefield.Quadrotor(mass_kg=0))
    refusal = refused(model=model)
    assert (refusal.code, refusal.field, refusal.value) == ("invalid", "quadrotor.mass_kg", "0")
    assert refusal.expected and refusal.expected in refusal.sentence and str(refusal) == refusal.sentence
    assert isinstance(refusal, gatefield.Refused) and isinstance(refusal, ValueError) and not refusal.may_pass


@pytest.mark.parametrize("changes, field, words", [
    ({"mass_kg": "heavy"}, "quadrotor.mass_kg", "'heavy' (str), expected a number"),
    ({"inertia_kg_m2": (1e-3, 1e-3)}, "quadrotor.inertia_kg_m2", "shape (3,)"),
    ({"rotor_position_B_m": np.zeros((3, 2))}, "quadrotor.rotor_position_B_m", "shape (3, 2) and dtype float64"),
    ({"rotor_spin": (1, 1, 2, -1)}, "quadrotor.rotor_spin", "1 or -1"),
])
def test_what_is_no_quadrotor(changes, field, words):
    refusal = refused(model=gatefield.Vehicle(gatefield.Quadrotor(**changes)))
    assert refusal.field == field and words in refusal.sentence


def test_what_is_no_camera_course_or_network():
    camera = gatefield.Camera(X_BC=np.ones((4, 4)))
    assert refused(model=gatefield.Vehicle(camera=camera)).field == "camera.X_BC"
    camera = gatefield.Camera(distortion_model="fisheye")
    assert "'none' or 'brown_conrady'" in refused(model=gatefield.Vehicle(camera=camera)).sentence
    assert refused(course=gatefield.Course([])).field.startswith("course")
    course = gatefield.Course([gatefield.Waypoint((5, 0)), gatefield.Waypoint((5, 0, 1))])
    assert refused(course=course).field == "course.waypoints[0].p_W"
    assert refused(network=gatefield.Network(peers="10.0.0.7")).field == "network.peers"
    assert refused(network=gatefield.Network(peers=["10.0.0.7:x"])).field == "network.peers"
    assert refused(domain=-1).field == "domain"
    assert refused(timing="sometimes").expected == "'real_time' or 'lockstep'"
    assert refused(timeout_s=float("nan")).field == "timeout_s"
    assert "attribute 'waypoints'" in refused(course=7).sentence


def test_defaults_are_those_of_the_sdk():
    assert gatefield.Quadrotor().mass_kg == 0.83
    assert gatefield.Camera().width_px == 160 and gatefield.Camera().cx_px == 80
    assert gatefield.Camera(X_BC=gatefield.forward_camera_mount(np.radians(15))).X_BC == gatefield.Camera().X_BC
    wide = gatefield.Camera.from_fov(640, 480, np.radians(90), np.radians(70), rate_hz=30)
    assert wide.fx_px == pytest.approx(320) and wide.rate_hz == 30
    assert gatefield.GateShape().opening == "square"


def test_a_camera_that_looks_forward_has_its_axes_where_the_page_says():
    X_BC = np.array(gatefield.forward_camera_mount(0.0, (0.1, 0.0, 0.05)))
    assert X_BC @ [0, 0, 1, 1] == pytest.approx([1.1, 0, 0.05, 1])  # forward is x of B
    assert X_BC @ [1, 0, 0, 1] == pytest.approx([0.1, -1, 0.05, 1])  # right is -y of B


def test_files_by_short_name_and_path(tmp_path):
    track = gatefield.Track.load("circle")
    assert len(track.course.waypoints) == 4 and track.course.laps == 3 and track.course.floor_z_m == 0
    assert np.linalg.norm(track.course.waypoints[0].direction_W) == pytest.approx(1)
    assert track.start_p_WB == pytest.approx((4.390, -4.090, 1.5))
    assert track.start_yaw_rad == pytest.approx(1.1956, abs=1e-3)
    assert gatefield.Vehicle.load("racer").quadrotor.mass_kg == pytest.approx(0.83)
    assert gatefield.Vehicle.load("racer-rates").actuation.kind == "body_rates"

    broken = tmp_path / "course.txt"
    broken.write_text("laps: 3\nclosed: true laps: many laps: 3\n")
    with pytest.raises(gatefield.Unreadable) as caught:
        gatefield.Course.load(broken)
    assert caught.value.file == str(broken) and caught.value.line == 2
    with pytest.raises(gatefield.UnknownName, match="circle"):
        gatefield.Course.load("oval")


def test_nanoseconds_are_exact():
    assert gatefield.nanoseconds(0.1) == 100_000_000 and gatefield.nanoseconds(-1.5) == -1_500_000_000
    assert isinstance(gatefield.now(), int)


def test_kinds_of_refusals():
    busy = errors.refusal("busy_name", "the name is in use", "vehicle")
    assert type(busy) is gatefield.Busy and busy.may_pass
    assert type(errors.refusal("frame", "no")) is gatefield.Refused
    again = pickle.loads(pickle.dumps(busy))
    assert (type(again), again.sentence, again.field) == (gatefield.Busy, "the name is in use", "vehicle")


def test_problems_have_sentences():
    assert "NED" in gatefield.Problem.states_look_ned.sentence
    stub = (Path(gatefield.__file__).parent / "_gatefield.pyi").read_text()
    for name in gatefield.Problem.__members__:
        assert f"    {name}: Problem\n" in stub


def test_stubs_name_what_there_is():
    stub = (Path(gatefield.__file__).parent / "_gatefield.pyi").read_text()
    for kind in (gatefield.Plan, gatefield.Setpoint, gatefield.Telemetry, gatefield.Statistics, gatefield.Session,
                 gatefield.Server, gatefield.PlannerHealth, gatefield.SessionChange, gatefield.ProblemChange):
        of_class = stub.split(f"class {kind.__name__}:")[1].split("\nclass ")[0]
        told = {line.split("def ")[1].split("(")[0] for line in of_class.splitlines() if "def " in line} - {"__init__"}
        there = {name for name in vars(kind) if not name.startswith("_")}
        assert told == there, kind


def test_states_are_plain():
    state = gatefield.State(p_WB=(0, 0, 1))
    assert [f.name for f in dataclasses.fields(state)][2] == "q_WB_wxyz" and state.q_WB_wxyz[0] == 1
