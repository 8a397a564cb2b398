"""Reads a campaign's trials.csv (gatefield-race) into arrays and draws how often races are won over speed.

    python3 success.py docs/results/rates/trials.csv success.png
Wilson's 95 % interval stands around each point. Exit code: 0 drawn, 2 no trials in the file.
"""

import csv
import sys

import numpy as np


def read_trials(path):
    """Columns as arrays: of numbers where all cells are numbers (an empty one is NaN), else of text."""
    with open(path, newline="") as file:
        rows = list(csv.DictReader(file))
    columns = {}
    for name in rows[0] if rows else []:
        cells = [row[name] for row in rows]
        try:
            columns[name] = np.array([float(cell) if cell else np.nan for cell in cells])
        except ValueError:
            columns[name] = np.array(cells)
    return columns


def wilson(won, flown, z=1.96):
    """The interval of a share, lower and upper end."""
    share = won / flown
    middle = share + z * z / (2 * flown)
    half = z * np.sqrt(share * (1 - share) / flown + z * z / (4 * flown * flown))
    return (middle - half) / (1 + z * z / flown), (middle + half) / (1 + z * z / flown)


def by_speed(trials, cell):
    """Speeds of a cell, and of each: races won and flown."""
    of_cell = trials["cell"] == cell
    speeds = np.unique(trials["speed_m_s"][of_cell])
    groups = [trials["success"][of_cell & (trials["speed_m_s"] == speed)] for speed in speeds]
    return speeds, np.array([group.sum() for group in groups]), np.array([len(group) for group in groups])


def main():
    import matplotlib
    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    source, target = sys.argv[1:3]
    trials = read_trials(source)
    if not trials:
        print(f"{source} has no trials, expected a trials.csv of gatefield-race", file=sys.stderr)
        return 2
    figure, axes = plt.subplots(figsize=(7, 4), layout="constrained")
    for cell in np.unique(trials["cell"]):
        speeds, won, flown = by_speed(trials, cell)
        low, high = wilson(won, flown)
        share = won / flown
        axes.errorbar(speeds, 100 * share, 100 * np.abs([share - low, high - share]), marker="o", capsize=3, label=cell)
        print(cell, ", ".join(f"{speed:g} m/s: {int(w)} of {n}" for speed, w, n in zip(speeds, won, flown)))
    axes.set(xlabel="speed limit, m/s", ylabel="races won, %", ylim=(-3, 103))
    axes.legend()
    figure.savefig(target, dpi=150)
    return 0


if __name__ == "__main__":
    sys.exit(main())
