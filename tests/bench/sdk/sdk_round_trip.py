"""What sdk_round_trip.cpp does, in Python.

    sdk_round_trip.py DOMAIN SECONDS
"""

import sys
import time

import numpy as np

import gatefield

WIDTH_PX, HEIGHT_PX, WALL_MM = 640, 480, 8000
PERIOD = 16_666_667  # nanoseconds
WARM = 60


def main():
    domain, length_s = int(sys.argv[1]), float(sys.argv[2])
    camera = gatefield.Camera.from_fov(WIDTH_PX, HEIGHT_PX, 1.5, 1.2)
    course = gatefield.Course([gatefield.Waypoint(p_W=(5, 0, 1.5), direction_W=(1, 0, 0))], closed=False)
    wall = np.full((HEIGHT_PX, WIDTH_PX), WALL_MM, np.uint16)
    state = gatefield.State(p_WB=(0, 0, 1.5))
    beyond_us = []
    with gatefield.connect(course, model=gatefield.Vehicle(camera=camera), vehicle="python", domain=domain,
                           timing="lockstep") as client:
        next_turn = time.monotonic_ns()
        for turn in range(WARM + int(length_s * 1e9 / PERIOD)):
            if turn == WARM:
                cpu_s, begin = time.process_time(), time.monotonic_ns()
            stamp = (turn + 1) * PERIOD
            client.send_depth(stamp, wall)
            client.wait_for_answer(client.send_state(stamp, state), timeout_s=2)
            left = time.monotonic_ns()
            plan = client.wait_for_answer(client.send_state(stamp + PERIOD // 2, state), timeout_s=2)
            came = time.monotonic_ns()
            if turn >= WARM:
                beyond_us.append((came - left) / 1e3 - plan.health.solve_time_s * 1e6)
            next_turn += PERIOD
            time.sleep(max(0, next_turn - time.monotonic_ns()) / 1e9)
        print(f"{time.process_time() - cpu_s:.6f} {(time.monotonic_ns() - begin) / 1e9:.6f}",
              *(f"{value_us:.1f}" for value_us in beyond_us))


if __name__ == "__main__":
    main()
