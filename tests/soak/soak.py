#!/usr/bin/env python3
"""Keeps a server busy for a long time, and looks whether it grows: clients come, fly some seconds, leave, are killed
in the middle; some send states that no vehicle is in, and somebody sends packets that no DDS participant sends.

  soak.py [--minutes 120] [--domain 9] [--programs build/release] [--seed 1]

Every round of a minute ends with a quiet moment, in which memory, threads, descriptors, files and /dev/shm are read.
Prints them; exit code 0 when none has grown since the warm-up (a tenth of the rounds, three at least) beyond its bar,
and at least four sessions a minute were flown.
Linux only.
"""
import argparse
import os
import random
import signal
import socket
import statistics
import struct
import subprocess
import sys
import tempfile
import threading
import time

ROUND_S, QUIET_S = 55.0, 9.0  # one that was killed is given up after 3 s, then the server tidies up
SLOTS = 3
MOST_GROWTH_KB = 2048
LEAST_SESSIONS_A_MINUTE = 500 / 120
SIZES = ((160, 90, 60), (320, 240, 30), (640, 480, 30))


def packet(draw):
    """Like RTPS at its beginning, then whatever."""
    head = b"RTPS\x02\x02\x01\x0f" + draw.randbytes(12)
    if draw.random() < 0.3:  # a statistics submessage that the library would assert
        return head + b"\x80\x01" + struct.pack("<H", 56) + bytes(64)
    body = b""
    for _ in range(draw.randint(0, 4)):
        content = draw.randbytes(draw.randint(0, 80))
        length = len(content) if draw.random() < 0.6 else draw.randint(0, 65535)
        body += struct.pack("<BBH", draw.choice((0x01, 0x06, 0x07, 0x08, 0x09, 0x0E, 0x12, 0x13, 0x15, 0x16)),
                            draw.randint(0, 255), length) + content
    return head + body


class Faults(threading.Thread):
    """Sends such packets to the ports of the domain's first participants."""

    def __init__(self, domain, seed):
        super().__init__(daemon=True)
        self.draw, self.sent, self.ends = random.Random(seed), 0, threading.Event()
        self.first = 7400 + 250 * domain

    def run(self):
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as out:
            while not self.ends.wait(0.05):
                port = self.first + 10 + self.draw.randint(0, 7)
                out.sendto(packet(self.draw), ("127.0.0.1", port))
                self.sent += 1


class Client:
    """One flight: a program with an end that was drawn before."""

    def __init__(self, options, draw, number, log):
        width, height, rate = draw.choice(SIZES)
        length_s = draw.uniform(2.0, 8.0)
        self.killed = draw.random() < 0.4
        words = [os.path.join(options.programs, "tests/integration/reach/reach_camera"), "--domain",
                 str(options.domain), "--name", f"soak{number}", "--width", str(width), "--height", str(height),
                 "--rate", str(rate)]
        if not self.killed:
            words += ["--seconds", str(length_s)]
        if draw.random() < 0.3:
            words += ["--bad"]
        self.ends_at = time.monotonic() + length_s + 1.0
        self.process = subprocess.Popen(words, stdout=log, stderr=log)

    def over(self):
        if self.killed and time.monotonic() > self.ends_at and self.process.poll() is None:
            self.process.send_signal(signal.SIGKILL)
        return self.process.poll() is not None


def sample(pid):
    with open(f"/proc/{pid}/status", encoding="utf-8") as status:
        lines = dict(line.split(":", 1) for line in status)
    descriptors = os.listdir(f"/proc/{pid}/fd")
    files = 0
    for number in descriptors:
        try:
            files += os.readlink(f"/proc/{pid}/fd/{number}").startswith("/")
        except OSError:
            pass
    return {"rss_kb": int(lines["VmRSS"].split()[0]), "threads": int(lines["Threads"]),
            "descriptors": len(descriptors), "files": files, "shm": len(os.listdir("/dev/shm"))}


def a_round(options, draw, state, log):
    """Clients come and go until the round is over; then all of them have gone."""
    end = time.monotonic() + ROUND_S
    clients = []
    while time.monotonic() < end or clients:
        if state["server"].poll() is not None:
            break
        clients = [client for client in clients if not client.over()]
        if time.monotonic() < end and len(clients) < SLOTS:
            state["sessions"] += 1
            clients.append(Client(options, draw, state["sessions"], log))
        time.sleep(0.1)
        if time.monotonic() > end + 20.0:
            for client in clients:
                client.process.kill()
    for client in clients:
        client.process.kill()


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--minutes", type=float, default=120.0)
    parser.add_argument("--domain", type=int, default=9)
    parser.add_argument("--programs", default="build/release")
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    draw = random.Random(options.seed)
    with tempfile.TemporaryDirectory(prefix="gatefield-soak-") as folder:
        with open(os.path.join(folder, "server.log"), "w+", encoding="utf-8") as server_log, \
                open(os.path.join(folder, "clients.log"), "w", encoding="utf-8") as client_log:
            server = subprocess.Popen([os.path.join(options.programs, "bin/gatefield-server"), "--domain",
                                       str(options.domain), "--log-level", "warn"], stderr=server_log)
            faults = Faults(options.domain, options.seed)
            faults.start()
            state, samples = {"server": server, "sessions": 0}, []
            begin = time.monotonic()
            try:
                while time.monotonic() - begin < 60.0 * options.minutes:
                    a_round(options, draw, state, client_log)
                    time.sleep(QUIET_S)
                    if server.poll() is not None:
                        server_log.seek(0)
                        print(f"the server ended with {server.returncode}:\n{server_log.read()[-2000:]}")
                        return 1
                    samples.append(sample(server.pid))
                    print(f"{(time.monotonic() - begin) / 60:6.1f} min  sessions {state['sessions']:5d}  "
                          f"packets {faults.sent:6d}  {samples[-1]}", flush=True)
            finally:
                faults.ends.set()
                server.send_signal(signal.SIGINT)
                try:
                    server.wait(10)
                except subprocess.TimeoutExpired:
                    server.kill()
    warm = max(3, len(samples) // 10)
    if len(samples) < warm + 2:
        print(f"{len(samples)} rounds are too few to tell growth, expected {warm + 2}: more --minutes")
        return 1
    # A server's memory goes up and down with its sessions: the middles of the first and of the last few are compared.
    few = max(1, (len(samples) - warm) // 10)
    middle = lambda part, name: statistics.median(one[name] for one in part)
    growth = {name: middle(samples[-few:], name) - middle(samples[warm:warm + few], name) for name in samples[0]}
    print(f"growth since the warm-up of {warm} rounds: {growth}")
    bars = {"rss_kb": MOST_GROWTH_KB, "threads": 0, "descriptors": 0, "files": 0}  # /dev/shm is everybody's
    grown = [name for name, bar in bars.items() if growth[name] > bar]
    if grown:
        print("grown beyond the bar: " + ", ".join(grown))
    wanted = int(LEAST_SESSIONS_A_MINUTE * options.minutes)
    if state["sessions"] < wanted:
        print(f"{state['sessions']} sessions are too few, expected {wanted}: a faster machine, or one that does less else")
    return 1 if grown or state["sessions"] < wanted else 0


if __name__ == "__main__":
    sys.exit(main())
