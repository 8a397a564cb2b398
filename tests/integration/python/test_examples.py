"""The examples fly, against the real server."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np

EXAMPLES = Path(os.environ["GATEFIELD_SOURCE_DIR"]) / "client/python/examples"


def run(name, *arguments):
    done = subprocess.run([sys.executable, EXAMPLES / name, *map(str, arguments)], capture_output=True, text=True,
                          timeout=600)
    return done.returncode, done.stdout + done.stderr


def test_the_minimal_client_passes_its_gate(server, domain):
    code, words = run("minimal.py", domain)
    assert code == 0 and words.startswith("passed"), words


def test_three_laps_are_won(server, domain):
    code, words = run("three_laps.py", "--domain", domain)
    assert code == 0 and "12 of 12" in words, words


def test_several_vehicles_in_one_process(server, domain):
    code, words = run("three_laps.py", "--domain", domain, "--vehicles", 2, "--laps", 1)
    assert code == 0 and "won 2 of 2" in words, words


def test_the_environment_flies_the_plan_when_nothing_is_added(server, domain):
    from learning import RaceEnv
    env = RaceEnv("circle", domain=domain)
    env.track.course.laps = 1
    try:
        first, _ = env.reset(seed=1)
        assert first.shape == env.observation_shape
        rewards = 0.0
        for _ in range(1500):
            _, reward, terminated, truncated, info = env.step(np.zeros(env.action_shape))
            rewards += reward
            if terminated or truncated:
                break
        assert info["won"] and rewards > 4, info
        again, _ = env.reset(seed=1)
        np.testing.assert_array_equal(first, again)
    finally:
        env.close()
