"""What gatefield-import writes, in the real programs: a campaign takes it, and a race is won on it."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

SOURCE = Path(os.environ["GATEFIELD_SOURCE_DIR"])
BIN = Path(os.environ["GATEFIELD_BINARY_DIR"]) / "bin"
DATA = SOURCE / "tests/data/import"
GATES = "--opening 1 --frame 1.5 --thickness 0.06 --floor 0 --margin 5"
REST = "--thrust-rate-max 20 --collision-radius 0.12 --camera racer"
COURSES = {
    "lsy": ("level.toml", "--gate-axis x --opening 0.4 --frame 0.72 --thickness 0.02 --pole-width 0.03 --scale 2.5"),
    "uzh": ("gates.yaml", GATES + " --start 0 0 1.5 0 --laps 1"),
    "cpc": ("track.yaml", GATES + " --laps 1"),
    "airsim": ("poses.json", "--opening 1.6 --frame 2.1333 --thickness 0.2 --no-floor --laps 1 --margin 5"),
}
VEHICLES = {
    "rotorpy": ("quad_params.py", REST + " --drag-speed 5"),
    "flightmare": ("quadrotor_dynamics.yaml", REST + " --drag-speed 5"),
    "urdf": ("quad.urdf", REST + " --drag 0.1 0.1 0.2"),
    "mjcf": ("quad.xml", REST + " --drag 0.1 0.1 0.2 --time-constant 0.03"),
}

pytestmark = pytest.mark.skipif(not (BIN / "gatefield-race").exists(), reason="built without the simulator")


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """With a file of each kind, made by the command as people call it."""
    made = tmp_path_factory.mktemp("imported")
    for kind, (name, options) in {**COURSES, **VEHICLES}.items():
        done = subprocess.run([sys.executable, "-m", "gatefield", "import", kind, DATA / name, "--out",
                               made / f"{kind}.txt",
                               *options.split()], capture_output=True, text=True, timeout=60)
        assert done.returncode == 0 and "note: " in done.stderr, done.stderr
    return made


def test_a_campaign_takes_them_all(folder):
    cells = [f'cell {{ name: "{course}-{vehicle}" course: "{course}.txt" vehicle: "{vehicle}.txt" }}'
             for course, vehicle in zip(COURSES, VEHICLES)]
    (folder / "campaign.txt").write_text('title: "imported"\ndefaults { profile: "race" model: "race" speed_m_s: 4 '
                                         "seeds { first: 1 last: 1 } }\n" + "\n".join(cells))
    done = subprocess.run([BIN / "gatefield-race", "run", folder / "campaign.txt", "--dry-run", "--out",
                           folder / "out"],
                          capture_output=True, text=True, timeout=120)
    assert done.returncode == 0 and all(f"{course}-" in done.stdout for course in COURSES), done.stdout + done.stderr


def test_a_race_is_won_with_them(server, domain, folder):
    done = subprocess.run([BIN / "gatefield-sim", "--domain", str(domain), "--lockstep", "--course", folder / "cpc.txt",
                           "--vehicle", folder / "rotorpy.txt", "--speed", "5", "--position-noise", "0.2"],
                          capture_output=True, text=True, timeout=600)
    assert done.returncode == 0 and "4 of 4" in done.stdout, done.stdout + done.stderr
