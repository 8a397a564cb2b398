#!/usr/bin/env python3
"""Python's client beside the one in C++, in one run: two vehicles with cameras of 640 x 480 at 60 Hz take turns with one
server, in lockstep.

  compare.py [--build build/release] [--turns 6] [--seconds 10] [--domain 8]

Prints, of each, what of a round trip goes beyond the server's step (median and 99th percentile of all turns together,
and the lowest and highest median of a turn) and how much of a core the client takes; then the differences.
"""
import argparse
import os
import statistics
import subprocess
import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent


def one_turn(words, environment):
    done = subprocess.run(words, env=environment, capture_output=True, text=True, timeout=300)
    if done.returncode != 0:
        sys.exit(f"{words[0]} ended with {done.returncode}: {done.stderr}")
    cpu_s, wall_s, *beyond_us = map(float, done.stdout.split())
    return cpu_s / wall_s, beyond_us


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build", default="build/release", type=Path)
    parser.add_argument("--turns", default=6, type=int)
    parser.add_argument("--seconds", default=10.0, type=float)
    parser.add_argument("--domain", default=8, type=int)
    options = parser.parse_args()
    of_the_turn = [str(options.domain), str(options.seconds)]
    clients = {"C++": [str(options.build / "tests/bench/sdk/sdk_round_trip"), *of_the_turn],
               "Python": [sys.executable, str(HERE / "sdk_round_trip.py"), *of_the_turn]}
    environment = {**os.environ, "PYTHONPATH": str((options.build / "python").resolve())}
    turns = {name: [] for name in clients}
    server = subprocess.Popen([options.build / "bin/gatefield-server", "--domain", str(options.domain),
                               "--log-level", "warn"])
    try:
        for turn in range(options.turns):
            for name in sorted(clients, reverse=turn % 2 == 1):
                turns[name].append(one_turn(clients[name], environment))
    finally:
        server.terminate()
        server.wait(20)
    figures = {}
    for name, all_turns in turns.items():
        beyond_us = sorted(value_us for _, part in all_turns for value_us in part)
        medians_us = [statistics.median(part) for _, part in all_turns]
        cores = statistics.median(share for share, _ in all_turns)
        figures[name] = statistics.median(beyond_us), cores
        print(f"{name:7s} beyond the step: n {len(beyond_us)}, p50 {figures[name][0]:.0f} us "
              f"({min(medians_us):.0f} to {max(medians_us):.0f}), p99 {beyond_us[int(0.99 * len(beyond_us))]:.0f} us; "
              f"{cores:.3f} cores")
    print(f"Python takes {figures['Python'][0] - figures['C++'][0]:+.0f} us at p50 "
          f"and {figures['Python'][1] - figures['C++'][1]:+.3f} cores more")


if __name__ == "__main__":
    main()
