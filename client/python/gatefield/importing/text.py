"""Gatefield's text files (common/config/*.proto), as people would write them."""

import math

from .rotations import yaw_deg


def number(value):
    """Nine digits, without those that say nothing."""
    shown = f"{float(value):.9g}"
    return "0" if float(shown) == 0 else shown


def vector(name, values):
    return name + " { " + " ".join(f"{axis}: {number(value)}" for axis, value in zip("xyz", values)) + " }"


def quoted(words):
    plain = "".join(c if c.isprintable() else " " for c in str(words))
    return '"' + plain.replace("\\", "\\\\").replace('"', '\\"') + '"'


def comments(lines):
    """As comments of at most 120 columns."""
    out = []
    for line in lines:
        row = "#"
        for word in str(line).split():
            if len(row) + 1 + len(word) > 120 and row != "#":
                out.append(row)
                row = "#  "
            row += " " + word
        out.append(row)
    return out


def gate_block(shape):
    opening = "ROUND" if shape.opening == "round" else "SQUARE"
    return (f"gate {{ opening: {opening} inner_half_m: {number(shape.inner_half_m)} "
            f"outer_half_m: {number(shape.outer_half_m)} thickness_m: {number(shape.thickness_m)} }}")


def waypoint_block(waypoint, common):
    direction = waypoint.direction_W
    if abs(direction[2]) < 1e-6 * math.hypot(direction[0], direction[1]):
        way = f"yaw_deg: {number(round(yaw_deg(direction), 6))}"
    else:
        way = vector("direction", [round(float(part), 9) for part in direction])
    own = "" if waypoint.gate == common else " " + gate_block(waypoint.gate)
    return f"waypoint {{ {vector('position', waypoint.p_W)} {way}{own} }}"


def course_text(head, track, poles, width_m):
    """A course file. poles: (x, y, top) each, on the floor. width_m: theirs."""
    course = track.course
    common = course.waypoints[0].gate
    lines = comments(head)
    lines += [f"title: {quoted(track.title)}", f"laps: {course.laps}",
              f"closed: {'true' if course.closed else 'false'}", ""]
    lines += [waypoint_block(waypoint, common) for waypoint in course.waypoints]
    lines += ["", gate_block(common)]
    lines.append(f"start {{ {vector('position', track.start_p_WB)} "
                 f"yaw_deg: {number(round(math.degrees(track.start_yaw_rad), 6))} }}")
    low, high = track.flight_volume
    lines.append(f"flight_volume {{ {vector('min', low)} {vector('max', high)} }}")
    for x, y, top in poles:
        lines.append(f"pole {{ x: {number(x)} y: {number(y)} z_bottom: {number(course.floor_z_m)} "
                     f"height: {number(top - course.floor_z_m)} width: {number(width_m)} }}")
    if course.floor_z_m is not None:
        lines.append(f"floor {{ z: {number(course.floor_z_m)} }}")
    return "\n".join(lines) + "\n"


def camera_block(camera, mount, head=()):
    """mount: x, y, z in metres, yaw left, pitch up, roll in degrees. head: comments in it."""
    lines = ["  " + line for line in comments(head)]
    lines += [f"  width_px: {camera.width_px}", f"  height_px: {camera.height_px}"]
    lines += [f"  {name}: {number(getattr(camera, name))}" for name in
              ("fx_px", "fy_px", "cx_px", "cy_px", "min_depth_m", "max_depth_m", "rate_hz", "metres_per_count")]
    mount = [round(float(value), 9) for value in mount]
    names = ("x_m", "y_m", "z_m", "yaw_left_deg", "pitch_up_deg", "roll_deg")
    lines.append("  mount { " + " ".join(f"{name}: {number(value)}" for name, value in zip(names, mount)) + " }")
    if camera.distortion_model == "brown_conrady":
        named = zip(("k1", "k2", "p1", "p2", "k3"), camera.distortion)
        terms = " ".join(f"{name}: {number(value)}" for name, value in named)
        lines.append(f"  distortion {{ model: BROWN_CONRADY {terms} }}")
    return "\n".join(["camera {", *lines, "}"])


def quadrotor_block(model, propeller_radius_m):
    xx, yy, zz = model.inertia_kg_m2
    lines = [f"  mass_kg: {number(model.mass_kg)}",
             f"  inertia_kg_m2 {{ xx: {number(xx)} yy: {number(yy)} zz: {number(zz)} }}"]
    lines += [f"  rotor {{ x_m: {number(x)} y_m: {number(y)} torque_sign: {sign} }}"
              for (x, y), sign in zip(model.rotor_position_B_m, model.rotor_spin)]
    lines += [f"  {name}: {number(getattr(model, name))}" for name in
              ("torque_per_thrust_m", "thrust_min_n", "thrust_max_n", "thrust_rate_max_n_s", "rotor_time_constant_s")]
    lines.append("  " + vector("drag_kg_s", model.drag_kg_s))
    lines.append(f"  collision_radius_m: {number(model.collision_radius_m)}")
    if any(model.body_rate_max_rad_s):
        lines.append("  " + vector("body_rate_max_rad_s", model.body_rate_max_rad_s))
    if propeller_radius_m is not None:
        lines.append(f"  propeller_radius_m: {number(propeller_radius_m)}")
    return "\n".join(["quadrotor {", *lines, "}"])


def vehicle_text(head, title, quadrotor, camera):
    return "\n".join([*comments(head), f"title: {quoted(title)}", "", quadrotor, "", camera, ""])


def replace_block(text, name, block):
    """`text` with the message `name` of its outermost level replaced; None when it has none or is not balanced."""
    start, depth, i, word, found = None, 0, 0, "", None
    while i < len(text):
        c = text[i]
        if c == "#":
            i = text.find("\n", i)
            if i < 0:
                break
        elif c in "\"'":
            i += 1
            while i < len(text) and text[i] != c:
                i += 2 if text[i] == "\\" else 1
        elif c in "{<":
            if depth == 0 and word.rstrip(":").strip() == name:
                start = i
            depth += 1
        elif c in "}>":
            depth -= 1
            if depth == 0 and start is not None and found is None:
                found = (text.rfind(name, 0, start), i + 1)
            word = ""
            i += 1
            continue
        if c.isalnum() or c in "_:":
            word = word + c if not text[i - 1:i].isspace() or c == ":" else c
        elif not c.isspace():
            word = ""
        i += 1
    if found is None or depth != 0:
        return None
    return text[:found[0]] + block + text[found[1]:]
