"""Courses of others: positions, ways through, sizes by hand-computed numbers; sentences on what is missing or wrong."""

import math

import pytest

import gatefield
from importing_support import DATA, GATES, changed, run, track

LSY = "--gate-axis x --opening 0.4 --frame 0.72 --thickness 0.02 --pole-width 0.03"


def ways(course):
    return [pytest.approx(tuple(waypoint.direction_W), abs=1e-6) for waypoint in course.waypoints]


def test_a_level_of_lsy(tmp_path):
    made, notes = track(tmp_path, "lsy", DATA / "level.toml", LSY)
    course = made.course
    assert [tuple(w.p_W) for w in course.waypoints] == [(0.5, 0.25, 0.7), (1, 0.8, 1.2), (-1, -0.2, 0.7),
                                                        (0, -0.7, 1.2)]
    assert [(math.cos(yaw), math.sin(yaw), 0) for yaw in (-0.5, 2.0, 3.0)] == ways(course)[:3]
    assert (math.cos(0.3), 0, -math.sin(0.3)) == ways(course)[3]  # pitched down by 0.3
    gate = course.waypoints[0].gate
    assert (gate.opening, gate.inner_half_m, gate.outer_half_m, gate.thickness_m) == ("square", 0.2, 0.36, 0.02)
    assert (course.laps, course.closed, course.floor_z_m) == (1, False, 0)
    assert tuple(made.start_p_WB) == (-1.5, 0.75, 0.7) and made.start_yaw_rad == pytest.approx(0.4)
    assert [tuple(corner) for corner in made.flight_volume] == [(-2.5, -1.5, -0.001), (2.5, 1.5, 2)]
    assert "raised to the first gate's height, 0.7 m" in notes and "along their own x axis" in notes
    text = (tmp_path / "out.txt").read_text()
    assert "pole { x: 1 y: 0.25 z_bottom: 0 height: 1.5 width: 0.03 }" in text and text.count("pole {") == 2


def test_older_levels_of_lsy_pass_along_y(tmp_path):
    file = changed(tmp_path, "level.toml", ("[0.0, 0.3, 0.0]", "[0.0, 0.1, 0.0]"),
                   ("[[env.track.drones]]", "[env.track.drone]"))
    run(tmp_path, "lsy", file, LSY, "x.txt")
    assert tuple(gatefield.Track.load(tmp_path / "x.txt").start_p_WB) == (-1.5, 0.75, 0.7)
    made, notes = track(tmp_path, "lsy", file, LSY.replace("axis x", "axis y") + " --start 0 0 1 90")
    assert "gate 3 is turned by 5.73 degrees about the way through it, which was left out" in notes
    assert (math.sin(0.5), math.cos(0.5), 0) == ways(made.course)[0]
    assert tuple(made.start_p_WB) == (0, 0, 1) and made.start_yaw_rad == pytest.approx(math.pi / 2)


def test_everything_is_scaled_alike(tmp_path):
    made, notes = track(tmp_path, "lsy", DATA / "level.toml", LSY + " --scale 2.5 --laps 3")
    assert tuple(made.course.waypoints[1].p_W) == (2.5, 2, 3) and made.course.waypoints[1].gate.inner_half_m == 0.5
    assert tuple(made.flight_volume[1]) == (6.25, 3.75, 5) and tuple(made.start_p_WB) == (-3.75, 1.875, 1.75)
    assert (made.course.laps, made.course.closed) == (3, True) and "2.5 times" in notes
    assert "height: 3.75 width: 0.075" in (tmp_path / "out.txt").read_text()


def test_obstacles_can_be_left_out_and_that_is_said(tmp_path):
    text, notes = run(tmp_path, "lsy", DATA / "level.toml", LSY + " --no-poles")
    assert "pole {" not in text and "its 2 obstacles were left out" in notes


def test_gates_of_uzh(tmp_path):
    made, notes = track(tmp_path, "uzh", DATA / "gates.yaml", GATES + " --start 0 0 1.5 0 --laps 2")
    assert [tuple(w.p_W) for w in made.course.waypoints] == [(4, 0, 1.5), (8, 3, 2), (4, 6, 1.5)]
    assert [(1, 0, 0), (0, 1, 0), (-1, 0, 0)] == ways(made.course)
    assert (made.course.laps, made.course.closed) == (2, True) and "w, x, y, z" in notes
    # 0.75 m outside and 4 m more around x of 0 to 8 and y of 0 to 6; the floor below.
    assert [tuple(corner) for corner in made.flight_volume] == [(-4.75, -4.75, 0), (12.75, 10.75, 6.75)]


def test_gates_of_uzh_in_another_order_with_sizes_of_their_own(tmp_path):
    file = changed(tmp_path, "gates.yaml", ("gates:\n", "orders: [Gate3, Gate1]\ngates:\n"),
                   ("    rotation: [1.0, 0.0, 0.0, 0.0]\n", "    rotation: [1.0, 0.0, 0.0, 0.0]\n    width: 0.8\n"))
    made, _ = track(tmp_path, "uzh", file, GATES.replace("--opening 1 ", "") + " --start 0 0 1.5 0 --laps 1")
    assert [(tuple(w.p_W), w.gate.inner_half_m) for w in made.course.waypoints] == [((4, 6, 1.5), 0.6),
                                                                                    ((4, 0, 1.5), 0.4)]


def test_a_track_of_cpc(tmp_path):
    made, notes = track(tmp_path, "cpc", DATA / "track.yaml", GATES)
    assert len(made.course.waypoints) == 4 and (made.course.laps, made.course.closed) == (2, True)
    assert [(1, 0, 0), (0, 1, 0), (-1, 0, 0), (0, -1, 0)] == ways(made.course)  # from neighbour to neighbour, upright
    assert tuple(made.start_p_WB) == (0, 0, 1.2)
    assert "repeat after 4" in notes and "2 points" in notes and "end point" in notes


def test_a_track_of_cpc_that_leans_and_does_not_repeat(tmp_path):
    file = tmp_path / "points.yaml"
    file.write_text("gates: [[3, 0, 1], [6, 0, 5], [6, 3, 5]]\nposition: [0, 0, 1]\n")
    made, _ = track(tmp_path, "cpc", file, GATES + " --inclined")
    assert (made.course.laps, made.course.closed) == (1, False)
    # (6, 0, 4), (3, 3, 4) and (0, 3, 0), of length 1; the first from the start on, the last from the one before.
    assert [(0.832050, 0, 0.554700), (0.514496, 0.514496, 0.685994), (0, 1, 0)] == ways(made.course)


def test_gate_poses_of_airsim(tmp_path):
    made, notes = track(tmp_path, "airsim", DATA / "poses.json",
                        "--opening 1.6 --frame 2.1333 --thickness 0.2 --no-floor --margin 4 --laps 1")
    # North stays x, east is -y, down is -z; in the order of their numbers: 0, 2, 10.
    assert [tuple(w.p_W) for w in made.course.waypoints] == [(6, -2, 2), (15, -4, 2.5), (24, 2, 3)]
    assert [(1, 0, 0), (1, 0, 0), (0, -1, 0)] == ways(made.course)
    assert [w.gate.inner_half_m for w in made.course.waypoints] == [0.8, 0.8, 0.4]  # the last one has scale 0.5
    assert made.start_yaw_rad == pytest.approx(-math.pi / 6) and tuple(made.start_p_WB) == (0, -1, 2)
    assert made.course.floor_z_m is None and "NED" in notes and "scale 1" in notes


def test_all_that_is_missing_is_said_at_once(tmp_path):
    with pytest.raises(gatefield.Invalid) as caught:
        run(tmp_path, "uzh", DATA / "gates.yaml", "")
    for option in ("--opening M", "--frame M", "--thickness M", "--floor Z or --no-floor", "--start X Y Z YAW_DEG",
                   "--laps N",
                   "--margin M"):
        assert option in caught.value.sentence
    assert caught.value.field == "--opening" and not (tmp_path / "out.txt").exists()


@pytest.mark.parametrize("kind, name, options, old, new, words", [
    ("lsy", "level.toml", LSY, "[0.5, 0.25, 0.7]", "[0.5, 0.25]",
     "env.track.gates[0].pos is [0.5, 0.25], expected x, y, z"),
    ("lsy", "level.toml", LSY, "0.8, 1.2]", "nan, 1.2]", "env.track.gates[1].pos[1] is nan, expected a finite number"),
    ("lsy", "level.toml", LSY, "rpy = [0.0, 0.0, 2.0]\n", "", "env.track.gates[1] has no 'rpy'"),
    ("lsy", "level.toml", LSY, "[env.track]\n", "[env.track\n", "is no TOML"),
    ("lsy", "level.toml", LSY, "rpy = [0.0, 0.0, -0.5]", "rpy = [0.5, 0.0, -0.5]", "gate 0 is turned by 28.6 degrees"),
    ("lsy", "level.toml", LSY.replace("0.4", "0.2"), "1.2]", "1.2]", "an opening of 0.2 m, expected 0.3 to 3 m"),
    ("lsy", "level.toml", LSY.replace("0.72", "0.3"), "1.2]", "1.2]", "outer_half_m"),
    ("uzh", "gates.yaml", "", "N: 3", "N: 3.5", "gates.N is 3.5, expected how many gates there are, 1 to 64"),
    ("uzh", "gates.yaml", "", "N: 3", "N: 4", "gates has no 'Gate4'"),
    ("uzh", "gates.yaml", "", "[0.0, 0.0, 0.0, 1.0]", "[0.0, 0.0, 0.0, 3.1]",
     "gates.Gate3.rotation is [0.0, 0.0, 0.0, 3.1], "
     "expected a quaternion of length 1"),
    ("uzh", "gates.yaml", "", "  N: 3", "  N: !!python/object/apply:os.getpid []", "is no YAML"),
    ("cpc", "track.yaml", GATES, "[5.0, 10.0, 1.5],", "[5.0, ten, 1.5],",
     "gates[2][1] is 'ten', expected a finite number"),
    ("airsim", "poses.json", GATES, '"x_val": 6.0', '"x_val": NaN', "Gate0.position.x_val is nan"),
    ("airsim", "poses.json", GATES, '"Gate2_5"', '"Gate0_5"', "expected names whose numbers differ"),
    ("airsim", "poses.json", GATES, '"z_val": 0.5}', '"z_val": 0.7}', "the same scale in x and z"),
    ("airsim", "poses.json", GATES, '{\n', "", "is no JSON"),
])
def test_what_is_wrong_is_said_with_file_field_value_and_expectation(tmp_path, kind, name, options, old, new, words):
    file = changed(tmp_path, name, (old, new))
    with pytest.raises(gatefield.Refused) as caught:
        run(tmp_path, kind, file, options)
    assert words in caught.value.sentence and name in caught.value.sentence, caught.value.sentence
    assert not list(tmp_path.glob("*.part*")) and not (tmp_path / "out.txt").exists()


def test_points_above_each_other_need_a_way(tmp_path):
    file = tmp_path / "points.yaml"
    file.write_text("gates: [[0, 0, 1], [5, 0, 3], [0, 0, 5]]\nring: true\n")
    with pytest.raises(gatefield.Invalid, match="gates.1. is .*--inclined"):
        run(tmp_path, "cpc", file, GATES)


def test_the_command_says_it_and_ends_with_2(tmp_path, capsys):
    from gatefield.importing import command
    assert command.main(["lsy", str(tmp_path / "none.toml"), "--out", str(tmp_path / "out.txt")]) == 2
    assert "none.toml can't be read: No such file" in capsys.readouterr().err
    assert command.main(["lsy", str(DATA / "level.toml"), "--out", str(tmp_path / "out.txt"), *LSY.split()]) == 0
    said = capsys.readouterr()
    assert "out.txt is written" in said.out and "note: rpy is roll, pitch, yaw" in said.err
