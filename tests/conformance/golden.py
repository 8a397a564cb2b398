#!/usr/bin/env python3
"""Writes tests/data/wire/*.hex: one sample of each wire type as little-endian CDR, from tests/support/messages.h's values.

Written by hand from the rules of CDR (OMG CORBA 3.3, 9.3: align each primitive to its size, counted from behind the
4 bytes of encapsulation; strings with length and final zero; sequences with length), so that it knows nothing of the
code it checks. session_request_version_1.hex is what this made while the protocol's version was 1; it stays as it is.
Run it again only when idl/gatefield.idl changes and PROTOCOL_VERSION is raised:  tests/conformance/golden.py tests/data/wire
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
    c = Cdr().u32(2).text("drone").u64(7).u8(0, 1).text("race").u64(42).f64(7.5)
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
    return c.f64(0.02, 0.03).u32(20).u64(0xFEDCBA9876543210).u8(0).text("").text("").text("")


def vehicle_state():
    c = Cdr().text("drone").u64(SESSION, 1).i64(1_234_567_890_123)
    c.f64(1.5, -2.25, 3.125).f64(4.5, 5.25, -6.125).f64(0.5, -0.5, 0.5, 0.5).f64(0.25, -0.5, 1.75)
    c.f64(2.0, 2.25, 2.5, 2.75).f64(2.125, 2.375, 2.625, 2.875)
    return c.u8(0).i64(4_200_000).u64(5).u32(2, 1)


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
    c.u64(1001, 2, 303, 4, 5, 996, 6).f64(0.00375, 1.0625, 0.03125, 0.046875, 0.0625).u8(1)
    return c.text("q_WB").text("of norm 2").text("norm 1").text("q_WB has norm 2, expected 1").text("avx2")


def main():
    folder = pathlib.Path(sys.argv[1])
    for make in (session_request, session_reply, vehicle_state, depth_frame, thrust_rate_command, telemetry):
        text = make().bytes().hex()
        lines = [text[i : i + 64] for i in range(0, len(text), 64)]
        (folder / (make.__name__ + ".hex")).write_text("\n".join(lines) + "\n")


main()
