"""The smallest client: joins a server, flies a simulated quadrotor through a gate, in lockstep.

    python3 minimal.py [DDS domain, 0 unless told]
Exit code: 0 passed, 1 no server or refused, 2 not passed.
"""

import sys

import numpy as np

import gatefield
from numpy_world import DepthCamera, Gates, Quadrotors, Referee

TURN = 10_000_000  # nanoseconds: how often the motors get something new


def main():
    domain = int(sys.argv[1]) if len(sys.argv) > 1 else 0
    gate = gatefield.Waypoint(p_W=(8, 0, 1.5), direction_W=(1, 0, 0))  # about where it is
    course = gatefield.Course([gate], closed=False)
    model = gatefield.Vehicle()
    gates = Gates(course, offset_m=0.3, seed=4)  # where it really is
    camera = DepthCamera(model.camera, gates)
    vehicle = Quadrotors(model.quadrotor, [[0, 0, 1.5]], yaw_rad=0)
    referee = Referee(course, gates, model.quadrotor.collision_radius_m, count=1)

    try:
        client = gatefield.connect(course, model=model, vehicle="minimal", domain=domain, timing="lockstep",
                                   speed_limit_m_s=5)
    except gatefield.Refused as refused:
        print(refused.sentence, file=sys.stderr)
        return 1
    with client:
        for turn in range(2000):
            stamp = (turn + 1) * TURN
            state = vehicle.state(0)
            if turn % 2 == 0:
                client.send_depth(stamp, camera.image(vehicle.p_W[0], vehicle.q[0]))
                client.wait_for_answer(client.send_state(stamp, state))
            setpoint = client.play(stamp, state, TURN)
            for _ in range(10):
                vehicle.step(setpoint.rotor_thrust_n[None], TURN / 10 / 1e9)
                referee.watch(vehicle.p_W)
            if referee.done[0]:
                break
        for change in client.problem_changes():
            print(change.problem.sentence, file=sys.stderr)
    print("passed" if referee.won[0] else "not passed", "after", stamp / 1e9, "s at", np.round(vehicle.p_W[0], 2))
    return 0 if referee.won[0] else 2


if __name__ == "__main__":
    sys.exit(main())
