#!/usr/bin/env python3
"""Writes tests/data/wire/*.hex: one sample of each wire type as little-endian CDR, from tests/support/messages.h's values.

Written by hand from the rules of CDR (OMG CORBA 3.3, 9.3: align each primitive to its size, counted from behind the
4 bytes of encapsulation; strings with length and final zero; sequences with length), so that it knows nothing of the
code it checks. session_request_version_1.hex is what this made while the protocol's version was 1; it stays as it is.
Those that begin with px4_ are PX4's, by the layouts of its releases (px4_msgs, branches release/1.15 to release/1.18).
Run it again only when idl/gatefield.idl or idl/ros.idl changes and PROTOCOL_VERSION is raised, or for a new release of PX4:  tests/conformance/golden.py tests/data/wire
"""

import pathlib
import struct
import sys


class Cdr:
    def __init__(self):
        self.body = b""

    def put(self, code, *values):
        size = struct.calcsize(code)
        for value in values:
            self.body += b"\0" * (-len(self.body) % size) + struct.pack("<" + code, value)
        return self

    def u8(self, *v):
        return self.put("B", *v)

    def i16(self, *v):
        return self.put("h", *v)

    def u32(self, *v):
        return self.put("I", *v)

    def u64(self, *v):
        return self.put("Q", *v)

    def i64(self, *v):
        return self.put("q", *v)

    def f32(self, *v):
        return self.put("f", *v)

    def f64(self, *v):
        return self.put("d", *v)

    def text(self, value):
        raw = value.encode() + b"\0"
        self.u32(len(raw))
        self.body += raw
        return self

    def bytes(self):
        return b"\x00\x01\x00\x00" + self.body  # CDR_LE, no options


SESSION = 0x1122334455667788


def health(c):
    return c.f64(0.0045, 123.5, -0.125, 0.0625, 0.0078125).u32(2, 1).u8(0, 1).u64(1 << 9 | 1 << 17)


def session_request():
    c = Cdr().u32(2).text("drone").u64(7).u8(0, 1).text("race").u64(42).f64(7.5).u8(7)
    # quadrotor
    c.f64(0.83, 3.1e-3, 3.1e-3, 5.0e-3)
    c.f64(0.0771, -0.0771, -0.0771, 0.0771, 0.0771, 0.0771, -0.0771, -0.0771)
    c.i16(1, 1, -1, -1)
    c.f64(0.016, 0.0, 10.0, 30.0, 0.025, 0.20, 0.20, 0.25, 0.13).f64(9, 9, 6)
    # actuation
    c.u8(0).f64(0, 0, 0, 0)
    # camera
    c.u32(160, 90).f64(84.25, 81.5, 80.0, 45.0, 0.3, 10.0, 60.0)
    c.f64(0.125, 0.0, 0.0625).f64(-0.5, 0.5, -0.5, 0.5)
    c.f64(0.0005).u8(1).f64(1e-5, -2e-5, 3e-6, -4e-6, 5e-6)
    # course
    c.u32(3)
    c.f64(3, 0, 1.5, 0, 1, 0).u8(0).f64(0.5, 0.75, 0.06).u32(0)
    c.f64(0, 3, 1.25, -1, 0, 0).u8(1).f64(0.6, 0.8, 0.125).u32(0)
    c.f64(-3, 0, 1.75, 0, 0, 0).u8(0).f64(0.5, 0.75, 0.06).u32(5)
    return c.u32(3).u8(1, 1).f64(-0.25)


def session_reply():
    c = Cdr().u32(2).text("drone").u64(7).u8(1).text("").text("planner-1").u64(SESSION)
    return c.f64(0.02, 0.03).u32(20).u64(0xFEDCBA9876543210).u8(0).text("").text("").text("").f64(1.5).u8(*range(1, 13))


def vehicle_state():
    c = Cdr().text("drone").u64(SESSION, 1).i64(1_234_567_890_123)
    c.f64(1.5, -2.25, 3.125).f64(4.5, 5.25, -6.125).f64(0.5, -0.5, 0.5, 0.5).f64(0.25, -0.5, 1.75)
    c.f64(2.0, 2.25, 2.5, 2.75).f64(2.125, 2.375, 2.625, 2.875)
    return c.u8(0).i64(4_200_000).u64(5).u32(2, 1).u8(2).f32(8.25, 0.5, -0.75, 1.25)


def depth_frame():
    width, height = 16, 16
    c = Cdr().text("drone").u64(SESSION, 1).i64(1_234_500_000_000).u32(width, height).u8(0)
    count = 2 * width * height
    return c.u32(count).u8(*((i * 7 + 1) % 256 for i in range(count)))


def thrust_rate_command():
    c = Cdr().text("drone").u64(SESSION, 1, 9)
    c.i64(1_234_567_890_123, 1_234_570_000_000, 30_000_000, 600_000_000)
    c.u32(20)
    for i in range(20):
        x = 0.25 * i
        c.f32(x, -x, x + 1, -x - 1).f32(2 + x, 2.5 + x, 3 + x, 3.5 + x).f32(11 + 4 * x).f32(x, -x, 0.5)
    return health(c).u8(0).text("avx2")


def telemetry():
    c = health(Cdr().text("drone").u64(SESSION).i64(99_000_000_001))
    c.u64(1001, 2, 303, 4, 5, 996, 6).f64(0.00375, 1.0625, 0.03125, 0.046875, 0.0625).f64(0.0, 2.5, 1.25).u8(1)
    return c.text("q_WB").text("of norm 2").text("norm 1").text("q_WB has norm 2, expected 1").text("avx2")


def server_status():
    return Cdr().u32(2).text("planner-1").f64(1.25).u32(3).u8(1).text("avx2").u64(0xFEDCBA9876543210)


def pilot_record():
    c = Cdr().text("drone").u32(1).u8(*[0] * 12).u64(0x8F00000000000001, 17).u8(1).u32(3).i64(123_456_789_012)
    return c.u32(4).u8(0, 1, 2, 255)


# Messages of ROS 2: tests/conformance/ros_golden_test.cpp has the same values.
def ros_header(c):
    return c.put("i", 1_700_000_000).u32(250_000_000).text("map")


def ros_pose(c):
    return c.f64(1.5, -2.5, 0.25).f64(0.5, -0.5, 0.5, 0.5)


def ros_pose_stamped():
    return ros_pose(ros_header(Cdr()))


def ros_odometry():
    c = ros_pose(ros_header(Cdr()).text("base_link")).f64(*[0.0] * 36)
    return c.f64(3.0, 0.125, -1.0).f64(0.25, -0.75, 2.0).f64(*[0.0] * 36)


def ros_image():
    c = ros_header(Cdr()).u32(2, 3).text("16UC1").u8(0).u32(8)
    return c.u32(16).u8(*(i * 5 for i in range(16)))


# ---- PX4's messages -----------------------------------------------------------------------------------------------

STAMP_US = 1_800_000_000_000_000


def px4_offboard_control_mode():
    return Cdr().u64(0).u8(0, 0, 0, 0, 1, 0, 0)


def px4_vehicle_rates_setpoint():
    return Cdr().u64(0).f32(1.5, -2.5, 0.25).f32(0, 0, -0.75).u8(0)


def px4_vehicle_command():
    c = Cdr().u64(0).f32(1, 6, 0, 0).f64(0, 0).f32(0).u32(176).u8(3, 1, 1)
    return c.put("H", 191).u8(2, 1)


def px4_vehicle_command_ack():
    return Cdr().u64(STAMP_US).u32(400).u8(1, 7).put("i", -5).u8(1).put("H", 191).u8(1)


def px4_vehicle_odometry():
    c = Cdr().u64(STAMP_US, STAMP_US - 3000).u8(1).f32(1.5, -2.5, 3.5).f32(0.5, -0.5, 0.5, 0.5).u8(3)
    c.f32(4.5, 5.5, -6.5).f32(0.25, -0.5, 0.75).f32(0.125, 0.25, 0.5).f32(1, 2, 4).f32(8, 16, 32)
    return c.u8(9).put("b", -1)


def px4_vehicle_status(before_masks, after_masks, before_last):
    c = Cdr().u64(STAMP_US, 11, 12).u8(2, 4, 6).u64(13).u8(14, 14, 0)
    before_masks(c)
    c.u32(0x80004000, 0x4000)
    after_masks(c)
    # hil, type, failsafe, user, deferred, gcs, counter, high latency, vtol, tailsitter, transition, to fw, type
    c.u8(0, 1, 1, 0, 0, 1, 3, 0, 0, 0, 0, 0, 2)
    c.u8(7, 1)  # system, component
    c.u8(0, 1, 1, 0, 0, 0, 0, 0)  # safety button .. parachute healthy
    c.u8(*before_last)
    return c.u8(0, 0, 1)  # rc calibration, calibration, checks pass


def px4_vehicle_status_v0():
    return px4_vehicle_status(lambda c: c, lambda c: c.put("H", 0), (0, 0))


def px4_vehicle_status_v1():
    return px4_vehicle_status(lambda c: c, lambda c: c.put("H", 0), ())


def px4_vehicle_status_v4():
    return px4_vehicle_status(lambda c: c.u8(14, 1), lambda c: c, (0,))


def px4_vehicle_land_detected():
    return Cdr().u64(STAMP_US).u8(0, 1, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0)


def px4_sensor_combined():
    c = Cdr().u64(STAMP_US).f32(0.25, -0.5, 0.75).u32(5000).put("i", 20).f32(1.5, -0.5, -9.75)
    return c.u32(5000).u8(0, 0, 3, 4)


def px4_timesync_status():
    return Cdr().u64(STAMP_US).u8(2).u64(STAMP_US + 7).i64(-40_000, -39_500).u32(850)


def px4_manual_control_setpoint():
    c = Cdr().u64(STAMP_US, STAMP_US - 5).u8(1, 1).f32(0.25, -0.25, 0, -1, 0)
    return c.f32(1, -1, 0.5, 0, 0.125, -0.5).u8(0).put("H", 5)


def px4_input_rc(frame_rate, link_snr):
    c = Cdr().u64(STAMP_US, STAMP_US - 9).u8(8).put("i", 80).u8(0, 1).put("H", 1, 2, 3)
    if frame_rate:
        c.put("H", 50)
    c.u8(13).put("H", *(1000 + 50 * i for i in range(18))).u8(99).f32(-60.5)
    return c.u8(20) if link_snr else c


def px4_input_rc_plain():
    return px4_input_rc(False, False)


def px4_input_rc_with_frame_rate():
    return px4_input_rc(True, True)


def px4_battery(currents, serial_number, tail):
    c = Cdr().u64(STAMP_US).u8(1).f32(15.75)
    c.f32(*range(1, 1 + currents)).f32(100, 0.5, 1, 600, 25).u8(4, 0, 0)
    c.put("H", 1500, 3, 4)
    if serial_number:
        c.put("H", 5)
    c.put("H", 6, 7, 8).u8(1).put("H", 0).f32(*([3.9375] * 14)).f32(0.125).u8(0, 1)
    return tail(c)


def px4_battery_status_filtered():
    def tail(c):
        c.put("H", 0).u32(0).u8(1, 0).f32(90, 20, 22, 11, 21).put("H", 9, 2).f32(14.8)
        return c

    return px4_battery(4, True, tail)


def px4_battery_status_v0():
    return px4_battery(2, True, lambda c: c.put("H", 0).u8(1).f32(22, 11).put("H", 2).f32(14.8, 1, 2, 3, 4, 5, 6, 7))


def px4_battery_status_v1():
    return px4_battery(2, False, lambda c: c.u8(1).put("H", 0).f32(22, 11).put("H", 2).f32(14.8, 1, 2, 3, 4, 5, 6, 7))


PX4 = (
    px4_offboard_control_mode, px4_vehicle_rates_setpoint, px4_vehicle_command, px4_vehicle_command_ack, px4_vehicle_odometry,
    px4_vehicle_status_v0, px4_vehicle_status_v1, px4_vehicle_status_v4, px4_vehicle_land_detected, px4_sensor_combined,
    px4_timesync_status, px4_manual_control_setpoint, px4_input_rc_plain, px4_input_rc_with_frame_rate,
    px4_battery_status_filtered, px4_battery_status_v0, px4_battery_status_v1,
)


def main():
    folder = pathlib.Path(sys.argv[1])
    for make in (session_request, session_reply, vehicle_state, depth_frame, thrust_rate_command, telemetry, server_status,
                 pilot_record, ros_pose_stamped, ros_odometry, ros_image, *PX4):
        text = make().bytes().hex()
        lines = [text[i : i + 64] for i in range(0, len(text), 64)]
        (folder / (make.__name__ + ".hex")).write_text("\n".join(lines) + "\n")


main()
