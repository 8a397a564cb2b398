"""Runs gatefield-import on the inputs of tests/data/import, whole or with something changed in them."""

import os
from pathlib import Path

import gatefield
from gatefield.importing import command

DATA = Path(os.environ["GATEFIELD_SOURCE_DIR"]) / "tests/data/import"
GATES = "--opening 1 --frame 1.5 --thickness 0.06 --floor 0 --margin 4"
VEHICLE = "--thrust-rate-max 20 --collision-radius 0.12 --camera racer"
CAMERA = "--min-depth 0.3 --max-depth 8 --rate 30 --mount 0.05 0.01 0.02 5 20 -3"


def changed(tmp_path, name, *changes):
    """A copy of an input in which each (old, new) was replaced; its path."""
    text = (DATA / name).read_text()
    for old, new in changes:
        assert old in text, old
        text = text.replace(old, new)
    (tmp_path / name).write_text(text)
    return tmp_path / name


def run(tmp_path, kind, file, options, out="out.txt"):
    """(text, notes) of what was written."""
    out, notes = command.convert([kind, str(file), "--out", str(tmp_path / out), *options.split()])
    return out.read_text(), "\n".join(notes)


def track(tmp_path, kind, file, options):
    """The course as the programs read it, and the notes."""
    _, notes = run(tmp_path, kind, file, options)
    return gatefield.Track.load(tmp_path / "out.txt"), notes


def vehicle(tmp_path, kind, file, options=VEHICLE):
    _, notes = run(tmp_path, kind, file, options)
    return gatefield.Vehicle.load(tmp_path / "out.txt"), notes


def camera(tmp_path, kind, file, options=CAMERA):
    base = Path(os.environ["GATEFIELD_SOURCE_DIR"]) / "deploy/config/vehicles/racer.txt"
    text, notes = run(tmp_path, kind, file, f"{options} --vehicle {base}")
    return gatefield.Vehicle.load(tmp_path / "out.txt"), text, notes
