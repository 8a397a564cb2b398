"""Levels of lsy_drone_racing: TOML with env.track.gates, .obstacles and .drones (older: .drone)."""

from .courses import Gate, Layout
from .rotations import of_rpy
from .source import read_toml


def read(path, _options):
    track = read_toml(path).need("env").need("track")
    drones = track.find("drones")
    drone = drones.nodes("a list of drones")[0] if drones is not None and drones.value else track.find("drone")
    notes = ["rpy is roll, pitch, yaw in radians about the fixed axes; z counts from the floor at 0"]
    if track.find("randomize") is not None and track.find("randomize").value is True:
        notes.append("env.track.randomize is on there: what is written is the nominal track")
    gates = []
    for node in track.need("gates").nodes("a list of gates"):
        gates.append(Gate(node.need("pos").vector(3, "x, y, z in metres"),
                          R_WG=of_rpy(node.need("rpy").vector(3, "roll, pitch and yaw in radians"))))
    if not gates:
        track.need("gates").refuse("at least one gate")
    poles = [node.need("pos").vector(3, "x, y and the top's z in metres") for node in
             (track.find("obstacles").nodes("a list of obstacles") if track.find("obstacles") is not None else [])]
    layout = Layout(f"lsy_drone_racing, {path.stem}", gates, laps=1, floor_z_m=0.0, poles=poles, notes=notes,
                    gate_axis_hint="today's releases: x, older ones: y")
    if drone is not None:
        layout.start_p_W = drone.need("pos").vector(3, "x, y, z in metres")
        rpy = drone.find("rpy")
        layout.start_yaw_rad = rpy.vector(3)[2] if rpy is not None else 0.0
    limits = track.find("safety_limits")
    if limits is not None:
        low = limits.need("pos_limit_low").vector(3, "x, y, z in metres")
        high = limits.need("pos_limit_high").vector(3, "x, y, z in metres")
        layout.volume = (low, high)
    if drones is not None and len(drones.nodes()) > 1:
        notes.append(f"{len(drones.nodes())} drones start there: the first one's start was taken")
    notes.append("gates' stands are not in the file, and not in this one")
    return layout
