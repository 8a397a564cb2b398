"""What the examples compute, without a server."""

import os
from pathlib import Path

import numpy as np
import pytest

import gatefield
import success
from numpy_world import DepthCamera, Gates, Quadrotors, Referee, rotation

SOURCE = Path(os.environ["GATEFIELD_SOURCE_DIR"])


def test_hover_stays_and_more_thrust_climbs():
    bodies = Quadrotors(gatefield.Quadrotor(), [[0, 0, 1], [0, 0, 1]], yaw_rad=0.3)
    hover = bodies.thrust.copy()
    hover[1] += 0.1
    for _ in range(100):
        bodies.step(hover, 0.001)
    assert bodies.p_W[0] == pytest.approx([0, 0, 1], abs=1e-9)
    assert 0.4 * 0.4 / 0.83 * 0.005 < bodies.p_W[1, 2] - 1 < 0.4 / 0.83 * 0.005


@pytest.mark.parametrize("rotors, axis, sign", [((1, 2), 0, 1), ((1, 3), 1, 1), ((0, 1), 2, 1)])
def test_rotors_turn_the_body_as_they_lie(rotors, axis, sign):
    """More thrust left rolls right (+x), behind pitches down (+y); rotors of spin 1 turn left (+z)."""
    bodies = Quadrotors(gatefield.Quadrotor(), [[0, 0, 1]], yaw_rad=0)
    asked = bodies.thrust.copy()
    asked[0, list(rotors)] += 0.2
    for _ in range(20):
        bodies.step(asked, 0.001)
    others = np.delete(bodies.w_B[0], axis)
    assert sign * bodies.w_B[0, axis] > 1e-3 and np.abs(others).max() < 1e-9


def test_quaternions_turn_left_about_z():
    bodies = Quadrotors(gatefield.Quadrotor(), [[0, 0, 1]], yaw_rad=np.pi / 2)
    assert rotation(bodies.q)[0] @ [1, 0, 0] == pytest.approx([0, 1, 0], abs=1e-12)


def test_the_camera_sees_the_frame_at_its_distance():
    course = gatefield.Course([gatefield.Waypoint((4, 0, 1.5), (1, 0, 0))], closed=False)
    camera = gatefield.Camera(X_BC=gatefield.forward_camera_mount())
    image = DepthCamera(camera, Gates(course)).image(np.array([0, 0, 1.5]), np.array([1.0, 0, 0, 0]))
    assert image.shape == (90, 160) and image.dtype == np.float32
    column = int(camera.cx_px - camera.fx_px * 0.62 / 3.97)  # the left bar's middle
    assert image[45, column] == pytest.approx(3.97, abs=1e-3)
    assert image[40, 80] == 0  # through the opening, above the floor's horizon


def test_the_referee_counts_and_sees_touches():
    course = gatefield.Course([gatefield.Waypoint((2, 0, 1.5), (1, 0, 0))], closed=False)
    referee = Referee(course, Gates(course), 0.13, count=2)
    for x in np.arange(0, 3, 0.02):
        referee.watch(np.array([[x, 0, 1.5], [x, 0.6, 1.5]]))
    assert referee.won.tolist() == [True, False] and referee.touched.tolist() == [False, True]


def test_trials_of_a_campaign_become_arrays_and_a_figure(tmp_path, monkeypatch, capsys):
    trials = success.read_trials(SOURCE / "docs/results/rates/trials.csv")
    assert len(trials["seed"]) == len(trials["cell"]) > 100 and trials["success"].max() == 1
    low, high = success.wilson(100.0, 100)
    assert (low, high) == (pytest.approx(0.963, abs=1e-3), pytest.approx(1.0))
    pytest.importorskip("matplotlib")
    figure = tmp_path / "success.png"
    monkeypatch.setattr("sys.argv", ["success.py", str(SOURCE / "docs/results/rates/trials.csv"), str(figure)])
    assert success.main() == 0
    assert figure.read_bytes().startswith(b"\x89PNG") and "8 m/s: 100 of 100" in capsys.readouterr().out


def test_the_minimal_client_is_short():
    lines = (SOURCE / "client/python/examples/minimal.py").read_text().splitlines()
    assert len(lines) <= 60
