"""Vehicles of others by hand-computed numbers, and what of their files is refused."""

import pytest

import gatefield
from importing_support import DATA, VEHICLE, changed, run, vehicle


def places(model):
    return [(*map(float, place), spin) for place, spin in zip(model.rotor_position_B_m, model.rotor_spin)]


def test_rotorpy(tmp_path):
    made, notes = vehicle(tmp_path, "rotorpy", DATA / "quad_params.py", VEHICLE + " --drag-speed 5")
    model = made.quadrotor
    assert model.mass_kg == 0.5 and tuple(model.inertia_kg_m2) == (3.0e-3, 3.2e-3, 5.5e-3)
    side = 0.16 * 0.5**0.5
    assert places(model) == [pytest.approx(place) for place in ((side, side, 1), (side, -side, -1), (-side, -side, 1),
                                                                (-side, side, -1))]
    assert model.torque_per_thrust_m == pytest.approx(0.02)  # 1e-7 / 5e-6
    assert model.thrust_min_n == pytest.approx(0.05) and model.thrust_max_n == pytest.approx(7.2)  # 5e-6 * 1200^2
    # At hover a rotor turns with sqrt(0.5 * 9.81 / 4 / 5e-6) = 495.227 rad/s: 4 * 1e-4 * 495.227 + 5 * 0.004, and
    # 4 * 2e-4 * 495.227 + 5 * 0.01.
    assert tuple(model.drag_kg_s) == pytest.approx((0.2180909, 0.2180909, 0.4461818), rel=1e-6)
    assert model.rotor_time_constant_s == 0.02 and model.thrust_rate_max_n_s == 20 and model.collision_radius_m == 0.12
    assert "propeller_radius_m: 0.08" in (tmp_path / "out.txt").read_text()
    assert "495.2 rad/s" in notes and made.camera.width_px == gatefield.Vehicle.load("racer").camera.width_px


def test_rotorpy_is_read_and_not_run(tmp_path):
    canary = tmp_path / "ran"
    file = changed(tmp_path, "quad_params.py", ("d = 0.16", f"d = __import__('os').mkdir({str(canary)!r})"))
    with pytest.raises(gatefield.Unreadable, match=r"quad_params.py:4: has .*other code is not run"):
        run(tmp_path, "rotorpy", file, VEHICLE)
    assert not canary.exists()
    file = changed(tmp_path, "quad_params.py", ("import numpy as np", f"import os\nos.mkdir({str(canary)!r})"))
    vehicle(tmp_path, "rotorpy", file, VEHICLE + " --drag 0.1 0.1 0.1")
    assert not canary.exists()


def test_flightmare(tmp_path):
    made, _ = vehicle(tmp_path, "flightmare", DATA / "quadrotor_dynamics.yaml", VEHICLE + " --drag-speed 5")
    model = made.quadrotor
    assert places(model) == [(0.08, -0.1, -1), (-0.08, 0.1, -1), (-0.08, -0.1, 1), (0.08, 0.1, 1)]
    assert model.thrust_max_n == pytest.approx(9.525)  # 1.5e-6 * 2500^2 + 1e-4 * 2500 - 0.1
    assert tuple(model.drag_kg_s) == pytest.approx((0.45, 0.25, 0.4))  # 0.2 + 0.01 * 5^2
    assert tuple(model.body_rate_max_rad_s) == (8, 8, 3) and model.torque_per_thrust_m == 0.02


def test_flightmare_of_an_arms_length(tmp_path):
    made, notes = vehicle(tmp_path, "flightmare", DATA / "arm_length.yaml", VEHICLE + " --drag 0.1 0.1 0.2")
    model, side = made.quadrotor, 0.2 * 0.5**0.5
    # 0.6 / 12 * 0.2^2 = 0.002, times 4.5, 4.5 and 7
    assert tuple(model.inertia_kg_m2) == pytest.approx((0.009, 0.009, 0.014)) and "as the program computes it" in notes
    assert places(model)[0] == pytest.approx((side, side, 1)) and places(model)[1] == pytest.approx((side, -side, -1))
    assert model.thrust_max_n == pytest.approx(8.0)


def test_urdf_with_motor_plugins(tmp_path):
    made, notes = vehicle(tmp_path, "urdf", DATA / "quad.urdf", VEHICLE + " --drag 0.1 0.1 0.2")
    model = made.quadrotor
    # The centre of mass is at (0.02 * 0.1 / 0.5, 0, -0.05 * 0.1 / 0.5) = (0.004, 0, -0.01); the battery lies
    # turned by 90 degrees. xx: 2e-3 + 0.4 * 0.01^2 + 4e-5 + 0.1 * 0.04^2. yy: 2.2e-3 + 0.4 (0.004^2 + 0.01^2) + 1e-5 +
    # 0.1 (0.016^2 + 0.04^2). zz: 4e-3 + 0.4 * 0.004^2 + 4e-5 + 0.1 * 0.016^2.
    assert model.mass_kg == 0.5 and tuple(model.inertia_kg_m2) == pytest.approx((2.24e-3, 2.442e-3, 4.072e-3))
    assert places(model) == [pytest.approx(place) for place in ((0.096, -0.12, -1), (-0.104, 0.12, -1),
                                                                (0.096, 0.12, 1),
                                                                (-0.104, -0.12, 1))]
    assert model.thrust_max_n == pytest.approx(5.12) and model.rotor_time_constant_s == 0.0125  # 8e-6 * 800^2
    assert "products of inertia of up to 8e-05" in notes  # 0.4 * 0.004 * 0.01 + 0.1 * 0.016 * 0.04


def test_urdf_with_properties(tmp_path):
    made, _ = vehicle(tmp_path, "urdf", DATA / "small.urdf",
                      "--thrust-rate-max 1 --collision-radius 0.05 --camera crazyflie "
                      "--drag 0.01 0.01 0.01 --time-constant 0.05 --spins -1 1 -1 1")
    model = made.quadrotor
    assert places(model) == [(0.028, 0.028, -1), (-0.028, 0.028, 1), (-0.028, -0.028, -1), (0.028, -0.028, 1)]
    assert model.torque_per_thrust_m == pytest.approx(0.025) and model.thrust_max_n == pytest.approx(0.14715)


def test_mjcf(tmp_path):
    made, _ = vehicle(tmp_path, "mjcf", DATA / "quad.xml", VEHICLE + " --drag 0.1 0.1 0.2 --time-constant 0.03")
    model = made.quadrotor
    # Box 0.2 (0.04^2 + 0.03^2), ball 0.4 * 0.2 * 0.02^2, bar about its axis 0.2 * 0.01^2 / 2, across
    # 0.2 (0.01^2 / 4 + 0.05^2 / 3); ball and bar 0.06 m off, 0.2 * 0.06^2 each.
    assert model.mass_kg == pytest.approx(1.0)
    assert tuple(model.inertia_kg_m2) == pytest.approx((5.42e-4, 2.5436667e-3, 2.6836667e-3), rel=1e-6)
    assert places(model) == [(0.1, -0.1, 1), (-0.1, 0.1, 1), (0.1, 0.1, -1), (-0.1, -0.1, -1)]
    assert model.thrust_max_n == 6 and model.torque_per_thrust_m == pytest.approx(0.018)


def test_mjcf_with_an_inertial_that_counts(tmp_path):
    file = changed(tmp_path, "quad.xml",
                   ("<freejoint/>", '<freejoint/><inertial pos="0 0 0.03" mass="0.8" euler="0 0 90" '
                                          'diaginertia="2e-3 3e-3 4e-3"/>'), ('<body name="tail" pos="-0.06 0 0">',
                                                                              '<body name="tail" pos="0 0 0.03">'))
    made, _ = vehicle(tmp_path, "mjcf", file, VEHICLE + " --drag 0.1 0.1 0.2 --time-constant 0.03")
    # The geoms of the body itself don't count; the bar of 0.2 kg lies in the same centre.
    assert made.quadrotor.mass_kg == pytest.approx(1.0)
    assert tuple(made.quadrotor.inertia_kg_m2) == pytest.approx((3.01e-3, 2.1716667e-3, 4.1716667e-3), rel=1e-6)


def test_rotors_by_hand_replace_what_the_file_lacks(tmp_path):
    file = changed(tmp_path, "quad.xml", ('site="s3"', 'joint="none"'))
    rotors = " ".join(f"--rotor {x} {y} {sign}" for x, y, sign in
                      ((0.1, -0.1, 1), (-0.1, 0.1, 1), (0.1, 0.1, -1), (-0.1, -0.1, -1)))
    made, _ = vehicle(tmp_path, "mjcf", file,
                      f"{VEHICLE} {rotors} --drag 0.1 0.1 0.2 --time-constant 0.03 --thrust-max 5 "
                      "--torque-per-thrust 0.01 --propeller-radius 0.06")
    assert made.quadrotor.thrust_max_n == 5 and list(made.quadrotor.rotor_spin) == [1, 1, -1, -1]


def test_what_the_reader_mends_or_refuses_is_said_of_the_file_and_with_the_option(tmp_path):
    file = changed(tmp_path, "quad_params.py", ("'Izz': 5.5e-3", "'Izz': 6.25e-3"))  # 0.8 % above 3.0e-3 + 3.2e-3
    _, notes = run(tmp_path, "rotorpy", file, VEHICLE + " --drag-speed 5")
    assert "out.txt: quadrotor.inertia_kg_m2.zz is 0.00625, taken as 0.0062" in notes and ".part" not in notes
    file = changed(tmp_path, "quad_params.py", ("'tau_m': 0.02", "'tau_m': 1e-4"))
    with pytest.raises(gatefield.Invalid, match="rotor_time_constant_s is 0.0001, expected 0.001 to 1 s; --time-constant"):
        run(tmp_path, "rotorpy", file, VEHICLE + " --drag-speed 5")


DRAG = VEHICLE + " --drag 0.1 0.1 0.2 --time-constant 0.03"


@pytest.mark.parametrize("kind, name, old, new, words", [
    ("rotorpy", "quad_params.py", "'mass': 0.5", "'mass': -0.5",
     "quad_params.mass is -0.5, expected a mass in kg above 0"),
    ("rotorpy", "quad_params.py", "'mass': 0.5", "'mass': 9**9**9", "can't be computed"),
    ("rotorpy", "quad_params.py", "'mass': 0.5", "'mass': [0] * 9", "computes with what is no number"),
    ("rotorpy", "quad_params.py", "'k_eta': 5.0e-6,", "", "quad_params has no 'k_eta'"),
    ("rotorpy", "quad_params.py", "'Ixy': 0.0", "'Ixy': 1e-3", "give --inertia XX YY ZZ"),
    ("rotorpy", "quad_params.py", "[1, -1, 1, -1]", "[1, -1, 1]",
     "rotor_directions is [1.0, -1.0, 1.0], expected 4 signs"),
    ("rotorpy", "quad_params.py", "quad_params = {", "quad_params = (", "is no Python"),
    ("rotorpy", "quad_params.py", "[1, -1, 1, -1]", "[1, 1, 1, 1]", "rotor_spin"),
    ("flightmare", "quadrotor_dynamics.yaml", "1.5e-6, 1.0e-4", "-1.5e-6, 1.0e-4", "thrust_map is [-1.5e-06"),
    ("flightmare", "quadrotor_dynamics.yaml", "tbm_bl: [-0.08, 0.1, 0.0]", "tbm_bl: [-0.08, 0.1]",
     "tbm_bl is [-0.08, 0.1]"),
    ("flightmare", "quadrotor_dynamics.yaml", "  kappa: 0.02\n", "", "quadrotor_dynamics has no 'kappa'"),
    ("urdf", "quad.urdf", '<link name="rotor_3"/>', "", "expected a parent and a child that are links of the file"),
    ("urdf", "quad.urdf", '<mass value="0.4"/>', '<mass value="heavy"/>',
     "link 'base_link'.inertial.mass.value is 'heavy'"),
    ("urdf", "quad.urdf", "rotor_3", "fan_3", "expected four, or --rotors NAME NAME NAME NAME"),
    ("urdf", "quad.urdf", '-0.12 0.02"/><axis xyz="0 0 1"/>', '-0.12 0.02"/><axis xyz="0 1 0"/>',
     "one along z of the body"),
    ("urdf", "quad.urdf", "<robot name", "<!DOCTYPE robot [<!ENTITY a 'b'>]>\n<robot name",
     "plain XML without <!DOCTYPE"),
    ("urdf", "small.urdf", 'km="7.5e-12"', 'km="7.5e-12"', "--spins S S S S (1 where the reaction"),
    ("mjcf", "quad.xml", 'type="mesh" mesh="looks"', 'type="mesh" mesh="looks" mass="0.1"',
     "geom 'looks'.type is 'mesh'"),
    ("mjcf", "quad.xml", "<freejoint/>", "", "expected one, or --body NAME of quad, tail"),
    ("mjcf", "quad.xml", 'ctrlrange="0 6"', 'ctrllimited="false"', "motor 't0' has no ctrlrange"),
    ("mjcf", "quad.xml", 'site="s3"', 'joint="none"', "four that push a site along z"),
    ("mjcf", "quad.xml", '"t3" site="s3" gear="0 0 1', '"t3" site="s3" gear="0 0 2', "rotors here are alike"),
    ("mjcf", "quad.xml", "<default>", '<include file="other.xml"/><default>', "a model in one file without it"),
    ("mjcf", "quad.xml", "</worldbody>", "", "is no XML"),
])
def test_what_is_wrong_is_said(tmp_path, kind, name, old, new, words):
    file = changed(tmp_path, name, (old, new))
    with pytest.raises(gatefield.Refused) as caught:
        run(tmp_path, kind, file, DRAG)
    assert words in caught.value.sentence and name in caught.value.sentence, caught.value.sentence
    assert not (tmp_path / "out.txt").exists()
