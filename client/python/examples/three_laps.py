"""Flies laps of a course on depth alone, in lockstep: quadrotors, camera and referee are NumPy (numpy_world.py).

    python3 three_laps.py --domain 0 --course circle --speed 6 --vehicles 1
With --vehicles 32 as many clients fly in this process, each with gates of its own, their dynamics in one array.
Exit code: 0 all won, 1 no server or refused, 2 not all won.
"""

import argparse
import contextlib
import sys

import numpy as np

import gatefield
from numpy_world import DepthCamera, Gates, Quadrotors, Referee

STEP = 1_000_000  # nanoseconds: of the dynamics
TURN = 5 * STEP  # how often motors get something new
CONTROL = 4 * TURN  # how often the server is asked


class Race:
    """Several vehicles, each in a world of its own."""

    def __init__(self, track: gatefield.Track, model: gatefield.Vehicle, count, offset_m, seed):
        self.gates = [Gates(track.course, offset_m, seed + i) for i in range(count)]
        self.cameras = [DepthCamera(model.camera, gates) for gates in self.gates]
        self.vehicles = Quadrotors(model.quadrotor, [track.start_p_WB] * count, track.start_yaw_rad)
        radius_m = model.quadrotor.collision_radius_m
        self.referees = [Referee(track.course, gates, radius_m, count=1) for gates in self.gates]
        self.stamp = 1_000_000_000

    def decided(self):
        return np.array([referee.done[0] for referee in self.referees])

    def control(self, clients):
        """Sends each vehicle's frame and state, then waits for all plans: the server works on them meanwhile."""
        asked = []
        for i, client in enumerate(clients):
            if not self.referees[i].done[0]:
                client.send_depth(self.stamp, self.cameras[i].image(self.vehicles.p_W[i], self.vehicles.q[i]))
                asked.append((client, client.send_state(self.stamp, self.vehicles.state(i))))
        return sum(client.wait_for_answer(sequence, timeout_s=10) is None for client, sequence in asked)

    def turn(self, clients):
        asked = np.array([client.play(self.stamp, self.vehicles.state(i), TURN).rotor_thrust_n
                          for i, client in enumerate(clients)])
        for _ in range(TURN // STEP):
            self.vehicles.step(asked, STEP / 1e9)
            for i, referee in enumerate(self.referees):
                if not referee.done[0]:
                    referee.watch(self.vehicles.p_W[i:i + 1])
        self.stamp += TURN


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--domain", type=int, default=0)
    parser.add_argument("--course", default="circle")
    parser.add_argument("--laps", type=int, default=3)
    parser.add_argument("--speed", type=float, default=6.0, help="m/s")
    parser.add_argument("--vehicles", type=int, default=1)
    parser.add_argument("--offset", type=float, default=0.3, help="how far each gate stands from where is told, m")
    parser.add_argument("--seed", type=int, default=1)
    asked = parser.parse_args()

    track = gatefield.Track.load(asked.course)
    track.course.laps = asked.laps
    model = gatefield.Vehicle()
    race = Race(track, model, asked.vehicles, asked.offset, asked.seed)
    late = 0
    with contextlib.ExitStack() as sessions:
        try:
            clients = [sessions.enter_context(
                gatefield.connect(track.course, model=model, vehicle=f"lap-{i}", domain=asked.domain, timing="lockstep",
                                  speed_limit_m_s=asked.speed, seed=asked.seed + i, timeout_s=20))
                       for i in range(asked.vehicles)]
        except gatefield.Refused as refused:
            print(refused.sentence, file=sys.stderr)
            return 1
        while not race.decided().all() and race.stamp < 121_000_000_000:
            if race.stamp % CONTROL == 0:
                late += race.control(clients)
            race.turn(clients)
        for client in clients:
            for change in client.session_changes():
                print(change.sentence, file=sys.stderr)
    won = [bool(referee.won[0]) for referee in race.referees]
    gates = [f"{referee.passed[0]} of {referee.due}" for referee in race.referees]
    print(f"won {sum(won)} of {len(won)} after {race.stamp / 1e9 - 1:.1f} s; gates {', '.join(gates)}; "
          f"{late} plans late")
    return 0 if all(won) else 2


if __name__ == "__main__":
    sys.exit(main())
