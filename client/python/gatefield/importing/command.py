"""gatefield-import KIND FILE --out FILE: a course, vehicle or calibration of others as a Gatefield file."""

import argparse
import os
import sys
from pathlib import Path

import gatefield
from gatefield.errors import Refused, refusal

from . import airsim, flightmare, lenses, lsy, mjcf, rotorpy, urdf, uzh
from .cameras import vehicle_with_camera
from .courses import AXES, course_file
from .vehicles import vehicle_file

COURSE, VEHICLE, CAMERA = "course", "vehicle", "camera"
KINDS = {
    "lsy": (COURSE, lsy.read, "level of lsy_drone_racing (TOML)"),
    "uzh": (COURSE, uzh.read, "gates with poses as UZH's racing tracks have them (YAML)"),
    "cpc": (COURSE, uzh.read_cpc, "track of CPC, rpg_time_optimal: points (YAML)"),
    "airsim": (COURSE, airsim.read, "gate poses of AirSim and its racing labs (JSON, NED)"),
    "rotorpy": (VEHICLE, rotorpy.read, "vehicle parameters of rotorpy (a Python file, which is not run)"),
    "flightmare": (VEHICLE, flightmare.read, "quadrotor_dynamics of flightmare and its kin (YAML)"),
    "urdf": (VEHICLE, urdf.read, "quadrotor in URDF"),
    "mjcf": (VEHICLE, mjcf.read, "quadrotor in MuJoCo's MJCF"),
    "ros": (CAMERA, lenses.read_ros, "camera_info of ROS (YAML)"),
    "opencv": (CAMERA, lenses.read_opencv, "FileStorage of OpenCV (YAML or XML)"),
    "realsense": (CAMERA, lenses.read_realsense, "intrinsics of a RealSense (JSON)"),
}
# What to do about a field that the programs' reader refuses.
CURES = {
    "camera.distortion": "; say --rectified, and send such images",
    "quadrotor.rotor_time_constant_s": "; --time-constant S says another",
    "quadrotor.drag_kg_s": "; --drag X Y Z says another",
    "quadrotor.thrust_max_n": "; --thrust-max N says another",
    "quadrotor.inertia_kg_m2": "; --inertia XX YY ZZ says another",
    "quadrotor.rotor_spin": "; --spins S S S S says others",
    "quadrotor.torque_per_thrust_m": "; --torque-per-thrust M says another",
}
WRITE = {COURSE: course_file, VEHICLE: vehicle_file, CAMERA: vehicle_with_camera}


def _whole(low, high):

    def read(text):
        value = int(text)
        if not low <= value <= high:
            raise argparse.ArgumentTypeError(f"{value} is not in {low} to {high}")
        return value

    return read


def _number(low, high=float("inf")):

    def read(text):
        value = float(text)
        if not low < value < high:
            raise argparse.ArgumentTypeError(f"{text} is not above {low:g}" + ("" if high == float("inf") else
                                                                             f" and below {high:g}"))
        return value

    return read


_LENGTH = _number(0, 10000)
_ANY = _number(-1e9, 1e9)


def _course_options(parser):
    add = parser.add_argument_group("what the file does not say",
                                    "Lengths are of the source's size, in metres.").add_argument
    add("--opening", type=_LENGTH, metavar="M", help="full width of the gates' openings")
    add("--frame", type=_LENGTH, metavar="M", help="full width of the gates outside")
    add("--thickness", type=_LENGTH, metavar="M", help="of the frames, along the way through")
    add("--round", action="store_true", help="openings are round; --opening and --frame are diameters")
    add("--gate-axis", choices=sorted(AXES), help="the gate's own axis that is flown along; write --gate-axis=-x")
    add("--inclined", action="store_true", help="cpc: gates lean as the way from point to point does")
    add("--laps", type=_whole(1, 1000), metavar="N", help="laps; with more than one the last gate leads to the first")
    add("--start", type=_ANY, nargs=4, metavar=("X", "Y", "Z", "YAW_DEG"),
        help="where the vehicle hovers before the race")
    add("--margin", type=_LENGTH, metavar="M", help="flight volume: so far around gates and start")
    add("--volume", type=_ANY, nargs=6, metavar=("X", "Y", "Z", "X", "Y", "Z"), help="flight volume by its corners")
    floor = parser.add_mutually_exclusive_group()
    floor.add_argument("--floor", type=_ANY, metavar="Z", help="height of the floor")
    floor.add_argument("--no-floor", action="store_true", help="there is none")
    add("--pole-width", type=_LENGTH, metavar="M", help="lsy: of the obstacles")
    add("--no-poles", action="store_true", help="lsy: leaves the obstacles out, which no planner here is told of")
    add("--scale", type=_LENGTH, default=1.0, metavar="F",
        help="multiplies every length, those of options, too (default: 1)")


def _vehicle_options(parser):
    add = parser.add_argument_group("what the file does not say, or says otherwise").add_argument
    add("--mass", type=_LENGTH, metavar="KG")
    add("--inertia", type=_LENGTH, nargs=3, metavar=("XX", "YY", "ZZ"), help="kg m^2")
    add("--rotor", type=_ANY, nargs=3, action="append", metavar=("X", "Y", "SIGN"),
        help="one of four; SIGN 1 where its reaction turns the body to the left, else -1")
    add("--spins", type=int, choices=(1, -1), nargs=4, metavar="S",
        help="of the rotors in the file's order, as SIGN above")
    add("--torque-per-thrust", type=_LENGTH, metavar="M")
    add("--thrust-max", type=_LENGTH, metavar="N", help="of one rotor")
    add("--thrust-rate-max", type=_LENGTH, metavar="N_S", help="of one rotor's commanded thrust, N/s")
    add("--time-constant", type=_LENGTH, metavar="S", help="of a rotor's thrust")
    add("--drag", type=_number(-1e-9), nargs=3, metavar=("X", "Y", "Z"), help="linear, N per m/s along the body's axes")
    add("--drag-speed", type=_LENGTH, metavar="V", help="quadratic or cubic drag is taken at this speed, m/s")
    add("--collision-radius", type=_LENGTH, metavar="M", help="sphere around body and arms")
    add("--propeller-radius", type=_LENGTH, metavar="M")
    add("--body-rate-max", type=_LENGTH, nargs=3, metavar=("X", "Y", "Z"), help="most that may be asked for, rad/s")
    add("--camera", metavar="FILE", help="a vehicle file or shipped vehicle whose camera it gets")
    add("--rotors", nargs=4, metavar="LINK", help="urdf: the rotors' links")
    add("--body", metavar="NAME", help="mjcf: the body that flies, when several have a free joint")


def _camera_options(parser):
    add = parser.add_argument_group("what the file does not say").add_argument
    add("--vehicle", metavar="FILE", help="vehicle file whose camera is replaced")
    add("--size", type=_whole(1, 100000), nargs=2, metavar=("WIDTH", "HEIGHT"), help="of the images, pixels")
    add("--rectified", action="store_true", help="images are sent rectified: no distortion")
    add("--min-depth", type=_LENGTH, metavar="M")
    add("--max-depth", type=_LENGTH, metavar="M")
    add("--rate", type=_LENGTH, metavar="HZ")
    add("--mount", type=_ANY, nargs=6, metavar=("X", "Y", "Z", "YAW_LEFT", "PITCH_UP", "ROLL"),
        help="metres in the body frame (x forward, y left, z up) and degrees")
    add("--metres-per-count", type=_LENGTH, metavar="M",
        help="of 16-bit images (default: as the file says, else 0.001)")
    add("--decimate", type=_whole(1, 64), default=1, metavar="N",
        help="images are sent with every Nth row and column binned")
    add("--matrix", metavar="NAME", help="opencv: the camera matrix, when it has an unusual name")
    add("--stream", metavar="NAME", help="realsense: which of several streams (default: depth)")


OPTIONS = {COURSE: _course_options, VEHICLE: _vehicle_options, CAMERA: _camera_options}


def _parser():
    parser = argparse.ArgumentParser(
        prog="gatefield-import",
        description="Makes a Gatefield course or vehicle file of what other projects have.",
        epilog="What a file does not say comes from an option; what had to be read one way among several is said. Exit "
        "code: 0 written, 2 not. Example: gatefield-import lsy level0.toml --out level0.txt --gate-axis x --opening "
        "0.4 --frame 0.72 --thickness 0.02 --pole-width 0.03 (docs/importing.md)")
    kinds = parser.add_subparsers(dest="kind", metavar="KIND", required=True)
    for name, (group, _, words) in KINDS.items():
        one = kinds.add_parser(name, help=f"{group}: {words}", description=f"Reads a {words}.")
        one.add_argument("file", type=Path, metavar="FILE")
        one.add_argument("--out", type=Path, required=True, metavar="FILE", help="the Gatefield file to write")
        one.add_argument("--title", help="in place of one made of the file's name")
        OPTIONS[group](one)
    return parser


def _checked(out, text, group, source):
    """Writes the file when the reader that the programs have takes it; returns that reader's notes."""
    draft = out.with_name(out.name + ".part.txt")
    try:
        draft.write_text(text, encoding="utf-8")
        loaded = (gatefield.Track if group == COURSE else gatefield.Vehicle).load(draft)
        if group == COURSE:
            _room(loaded, source)
        os.replace(draft, out)
        return [note.replace(str(draft), str(out)) for note in getattr(loaded, "notes", ())]
    except OSError as error:
        raise refusal("unreadable", f"{out} can't be written: {error.strerror}", file=str(out)) from None
    except Refused as refused:
        words = refused.sentence.replace(str(draft), str(out))
        cure = next((cure for field, cure in CURES.items() if refused.field.startswith(field)), "")
        raise refusal(refused.code, f"{source} makes a file that the programs refuse: {words}{cure}", refused.field,
                      refused.value, refused.expected, str(source)) from None
    finally:
        draft.unlink(missing_ok=True)


def _room(track, source):
    """Openings that are flown (docs/courses-and-vehicles.md): said here, since only a server that is joined says so."""
    for i, waypoint in enumerate(track.course.waypoints):
        opening_m = 2 * waypoint.gate.inner_half_m
        if not 0.3 <= opening_m <= 3:
            raise refusal("invalid", f"{source}: waypoint[{i}] has an opening of {opening_m:g} m, expected 0.3 to 3 m, "
                          "which is what is flown (--opening, --scale)", f"waypoint[{i}].gate.inner_half_m")


def convert(arguments):
    """Does what the command line says; returns what it wrote as text, and the notes on it."""
    options = _parser().parse_args(arguments)
    group, read, _ = KINDS[options.kind]
    made = read(options.file, options)
    head = [f"Made by gatefield-import {options.kind} of {options.file.name}."]
    text = WRITE[group](options.file, made, options, head)
    notes = [*made.notes, *_checked(options.out, text, group, options.file)]
    return options.out, notes


def main(arguments=None):
    try:
        out, notes = convert(sys.argv[1:] if arguments is None else arguments)
    except Refused as refused:
        print(f"gatefield-import: {refused.sentence}", file=sys.stderr)
        return 2
    for note in notes:
        print(f"note: {note}", file=sys.stderr)
    print(f"{out} is written")
    return 0


if __name__ == "__main__":
    sys.exit(main())
