"""Every input with a line taken out: something is written, or it is said why not. Nothing else happens."""

import sys

import pytest

import gatefield
from importing_support import CAMERA, DATA, VEHICLE, run
from test_importing_cameras import RACER
from test_importing_courses import LSY

GATES = "--opening 1 --frame 1.2 --thickness 0.06 --no-floor --margin 4 --laps 1"
MORE = f"{VEHICLE} --drag 0.1 0.1 0.2 --time-constant 0.03"
INPUTS = [("lsy", "level.toml", LSY), ("uzh", "gates.yaml", GATES + " --start 0 0 1.5 0"), ("cpc", "track.yaml", GATES),
          ("airsim", "poses.json", GATES), ("rotorpy", "quad_params.py", MORE), ("flightmare", "arm_length.yaml", MORE),
          ("flightmare", "quadrotor_dynamics.yaml", MORE), ("urdf", "quad.urdf", MORE), ("mjcf", "quad.xml", MORE),
          ("urdf", "small.urdf", MORE.replace("0.1 0.1 0.2", "0.01 0.01 0.01") + " --spins -1 1 -1 1"),
          *((kind, name, f"{CAMERA} --rectified --vehicle {RACER}") for kind, name in
            (("ros", "camera_info.yaml"), ("opencv", "calibration.yml"), ("opencv", "calibration.xml"),
             ("realsense", "realsense.json")))]


@pytest.mark.parametrize("kind, name, options", INPUTS)
def test_a_line_is_missing(tmp_path, kind, name, options):
    lines = (DATA / name).read_text().splitlines(True)
    run(tmp_path, kind, DATA / name, options)  # whole, it is taken
    for i in range(len(lines)):
        (tmp_path / name).write_text("".join(lines[:i] + lines[i + 1:]))
        try:
            run(tmp_path, kind, tmp_path / name, options)
        except gatefield.Refused as refused:
            assert name in refused.sentence


@pytest.mark.parametrize("kind, name, options, modules, words", [
    ("lsy", "level.toml", LSY, ("tomllib", "tomli"), "install tomli"),
    ("uzh", "gates.yaml", GATES, ("yaml", ), "apt install python3-yaml"),
])
def test_a_python_without_the_library_is_told_which(tmp_path, monkeypatch, kind, name, options, modules, words):
    for module in modules:
        monkeypatch.setitem(sys.modules, module, None)
    with pytest.raises(gatefield.Unsupported, match=words):
        run(tmp_path, kind, DATA / name, options)
