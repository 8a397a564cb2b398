"""Camera calibrations of others in a vehicle file, by hand-computed numbers."""

import math
import os
from pathlib import Path

import numpy as np
import pytest

import gatefield
from gatefield.importing.cameras import mount_of
from gatefield.importing.text import replace_block
from importing_support import CAMERA, DATA, camera, changed, run

RACER = Path(os.environ["GATEFIELD_SOURCE_DIR"]) / "deploy/config/vehicles/racer.txt"


def lens(made):
    c = made.camera
    return (c.width_px, c.height_px, c.fx_px, c.fy_px, c.cx_px, c.cy_px)


def test_ros_rectified_and_decimated(tmp_path):
    made, text, notes = camera(tmp_path, "ros", DATA / "camera_info.yaml", CAMERA + " --rectified --decimate 4")
    # Of the projection matrix: (318.5 + 0.5) / 4, (179.5 + 0.5) / 4.
    assert lens(made) == (160, 90, 77.5, 78, 79.75, 45) and made.camera.distortion_model == "none"
    assert (made.camera.min_depth_m, made.camera.max_depth_m, made.camera.rate_hz) == (0.3, 8, 30)
    assert "projection matrix" in notes and "millimetres" in notes and text.count("camera {") == 1
    assert made.quadrotor == gatefield.Vehicle.load(RACER).quadrotor and "propeller_radius_m: 0.061" in text


def test_the_mounting_is_the_one_told(tmp_path):
    made, _, _ = camera(tmp_path, "ros", DATA / "camera_info.yaml", CAMERA + " --rectified")
    X_BC = np.array(made.camera.X_BC)
    assert mount_of(X_BC) == pytest.approx((0.05, 0.01, 0.02, 5, 20, -3))
    yaw, pitch = math.radians(5), math.radians(20)
    assert X_BC[:3,
                2] == pytest.approx((math.cos(pitch) * math.cos(yaw), math.cos(pitch) * math.sin(yaw), math.sin(pitch)))


def test_ros_distortion_that_is_too_much(tmp_path):
    with pytest.raises(gatefield.Refused, match="camera.distortion .*say --rectified"):
        camera(tmp_path, "ros", DATA / "camera_info.yaml")


@pytest.mark.parametrize("name", ["calibration.yml", "calibration.xml"])
def test_opencv(tmp_path, name):
    made, _, _ = camera(tmp_path, "opencv", DATA / name)
    assert lens(made) == (640, 480, 400, 402, 320, 240) and made.camera.distortion_model == "brown_conrady"
    assert tuple(made.camera.distortion) == pytest.approx((1e-4, -2e-5, 0, 0, 0))


def test_realsense(tmp_path):
    made, _, notes = camera(tmp_path, "realsense", DATA / "realsense.json")
    assert lens(made) == (848, 480, 425, 425.5, 424, 240.75) and made.camera.metres_per_count == 0.001
    assert "millimetres" not in notes  # the file says its scale


def test_a_second_calibration_replaces_the_first(tmp_path):
    _, first, _ = camera(tmp_path, "realsense", DATA / "realsense.json")
    (tmp_path / "mine.txt").write_text(first)
    second, _ = run(tmp_path, "opencv", DATA / "calibration.yml", f"{CAMERA} --vehicle {tmp_path / 'mine.txt'}",
                    "mine.txt")
    assert second.count("Made by gatefield-import") == 1 and "width_px: 640" in second and "848" not in second


def test_blocks_are_found_by_their_braces():
    text = 'title: "camera { }" # camera { }\nquadrotor { a { } }\ncamera: { mount { x_m: 1 } # }\n}\nactuation { }\n'
    assert replace_block(text, "camera", "NEW") == \
        'title: "camera { }" # camera { }\nquadrotor { a { } }\nNEW\nactuation { }\n'
    assert replace_block("quadrotor { camera { } }", "camera", "NEW") is None
    assert replace_block("camera { ", "camera", "NEW") is None


@pytest.mark.parametrize("kind, name, options, old, new, words", [
    ("ros", "camera_info.yaml", "", "data: [320.0,", "data: [-320.0,",
     "expected a camera matrix with focal lengths above 0"),
    ("ros", "camera_info.yaml", "", "plumb_bob", "equidistant",
     "distortion_model is 'equidistant', expected plumb_bob"),
    ("ros", "camera_info.yaml", "--rectified --decimate 7", "640", "640",
     "640 pixels wide or high, expected a multiple"),
    ("ros", "camera_info.yaml", "", "camera_matrix:", "matrix:", "has no 'camera_matrix' or 'K'"),
    ("opencv", "calibration.yml", "", "image_width: 640\n", "", "give --size WIDTH HEIGHT"),
    ("opencv", "calibration.yml", "--matrix M2", "dt: d", "dt: d", "has no 'M2'"),
    ("opencv", "calibration.xml", "", "1e-4 -2e-5 0. 0. 0.", "1e-4 -2e-5 0. 0. 0. 1 0 0",
     "no more than k1, k2, p1, p2, k3"),
    ("opencv", "calibration.xml", "", "<distortion_coefficients", "<others", "is no XML"),
    ("realsense", "realsense.json", "--stream color", "424", "424", "has no 'color'"),
    ("realsense", "realsense.json", "", '"fx": 425.0', '"fx": "wide"', "depth.fx is 'wide', expected a focal length"),
    ("realsense", "realsense.json", "", "brown_conrady\", \"coeffs\": [0.0",
     "inverse_brown_conrady\", \"coeffs\": [0.1",
     "depth.model is 'distortion.inverse_brown_conrady'"),
    ("realsense", "realsense.json", "", '"width": 848', '"width": 1300',
     "camera.width_px is 1300, expected 16 to 1280"),
])
def test_what_is_wrong_is_said(tmp_path, kind, name, options, old, new, words):
    text = (DATA / name).read_text()
    file = changed(tmp_path, name, (old, new)) if old in text else DATA / name
    with pytest.raises(gatefield.Refused) as caught:
        run(tmp_path, kind, file, f"{CAMERA} --vehicle {RACER} {options}")
    assert words in caught.value.sentence and name in caught.value.sentence, caught.value.sentence


def test_no_vehicle_file_and_no_answers_are_said(tmp_path):
    (tmp_path / "course.txt").write_text("gate { }\n")
    with pytest.raises(gatefield.Invalid, match="course.txt has no camera"):
        run(tmp_path, "realsense", DATA / "realsense.json", f"{CAMERA} --vehicle {tmp_path / 'course.txt'}")
    with pytest.raises(gatefield.Invalid) as caught:
        run(tmp_path, "realsense", DATA / "realsense.json", "")
    assert all(option in caught.value.sentence for option in ("--min-depth", "--max-depth", "--rate", "--mount",
                                                              "--vehicle"))
