#!/usr/bin/env python3
"""Races in real time over a link that loses, delays, and is cut: two network namespaces (slow_link.py). Needs root.

  link_races.py --out out/links                  all rows of docs/reliability.md: 40 races over a bad link, 20 of each outage
  link_races.py --out out/links --rows loss --races 5

A race is one of circle-0.3m at 7 m/s with a seed of its own. An outage begins 4 to 10 s after the client's start. What was
flown stands in trials.csv of the folder, and is not flown again. Real time: let nothing else run.
Exit code 0 when each row reaches its bar: 19 of 20.
"""
import argparse
import csv
import math
import pathlib
import random
import re
import sys

from slow_link import Link

# Name: races, link, seconds of outage.
ROWS = {
    "loss": (40, {"delay_ms": 50.0, "loss": 0.05}, 0.0),
    "outage-0.3": (20, {"delay_ms": 1.0}, 0.3),
    "outage-1.5": (20, {"delay_ms": 1.0}, 1.5),
    "outage-5": (20, {"delay_ms": 1.0}, 5.0),
}
BAR = 0.95
FIELDS = ["row", "seed", "code", "outcome", "outage_at_s"]


def interval(won, flown):
    """Wilson's 95 % interval, in percent."""
    z, share = 1.96, won / flown
    middle = (share + z * z / (2 * flown)) / (1 + z * z / flown)
    half = z / (1 + z * z / flown) * math.sqrt(share * (1 - share) / flown + z * z / (4 * flown * flown))
    return 100 * max(0.0, middle - half), 100 * min(1.0, middle + half)


def outcome_of(words, code):
    """The referee's verdict, as gatefield-sim prints it last."""
    if code == 0:
        return "won"
    said = re.findall(r"^Result\s+(.+)$", words, re.MULTILINE)
    return said[-1].strip() if said else f"exit code {code}"


def fly(row, seed, options):
    _, link, outage_s = ROWS[row]
    at_s = random.Random(f"{row} {seed}").uniform(4.0, 10.0)
    log = options.out / f"{row}-{seed}.log"
    with open(log, "w") as file:
        code = Link(**link, seed=seed, outage=(at_s, at_s + outage_s) if outage_s else None).fly(
            f"{options.programs}/gatefield-server --domain 7",
            f"{options.programs}/gatefield-sim --domain 7 --realtime --scenario circle-0.3m --speed 7 --seed {seed}", file)
    outcome = outcome_of(log.read_text(errors="replace"), code)
    if code == 0:
        log.unlink()  # those that were lost are worth reading
    return {"row": row, "seed": seed, "code": code, "outcome": outcome, "outage_at_s": f"{at_s:.2f}" if outage_s else ""}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=pathlib.Path, required=True, help="folder of the results; one that has some is gone on with")
    parser.add_argument("--programs", type=pathlib.Path, default=pathlib.Path("build/release/bin"))
    parser.add_argument("--rows", nargs="+", choices=ROWS, default=list(ROWS))
    parser.add_argument("--races", type=int, help="of each row, in place of its own number")
    parser.add_argument("--first-seed", type=int, default=2001)
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    table = options.out / "trials.csv"
    trials = list(csv.DictReader(table.open())) if table.exists() else []
    done = {(trial["row"], int(trial["seed"])) for trial in trials}
    wanted = [(row, options.first_seed + i) for row in options.rows for i in range(options.races or ROWS[row][0])]
    left = [trial for trial in wanted if trial not in done]
    with table.open("a", newline="") as file:
        writer = csv.DictWriter(file, FIELDS)
        if not trials:
            writer.writeheader()
        for number, (row, seed) in enumerate(left, 1):
            trial = fly(row, seed, options)
            trials.append(trial)
            writer.writerow(trial)
            file.flush()
            print(f"{number} of {len(left)}  {row} {seed}: {trial['outcome']}", flush=True)
    print("\n| link | won | 95 % interval |\n| --- | ---: | --- |")
    missed = []
    for row in options.rows:
        flown = [trial for trial in trials if trial["row"] == row]
        if not flown:
            continue
        won = sum(int(trial["code"]) == 0 for trial in flown)
        low, high = interval(won, len(flown))
        print(f"| {row} | {won} of {len(flown)} | {low:.0f} to {high:.0f} % |")
        if won < BAR * len(flown):
            missed.append(row)
    if missed:
        print(f"below {100 * BAR:.0f} %: " + ", ".join(missed))
    return 1 if missed else 0


if __name__ == "__main__":
    sys.exit(main())
