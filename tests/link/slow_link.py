#!/usr/bin/env python3
"""A slow link that is real: two network namespaces, and between them this program, which holds each packet for a while
or loses it. What netem would do, for kernels without it. Needs root, ip, and /dev/net/tun. Linux only.

  slow_link.py --delay-ms 25 --loss 0.01 --server "build/release/bin/gatefield-server --domain 7" \\
               --client "build/release/bin/gatefield-sim --domain 7 --realtime --scenario circle-0.3m --speed 7"

Starts the server in one namespace and, 3 s later, the client in the other; exits with the client's code. --delay-ms,
--jitter-ms (uniform, on top; packets don't overtake each other) and --loss are of each way.
"""
import argparse
import collections
import fcntl
import os
import random
import select
import shlex
import signal
import struct
import subprocess
import sys
import time

TUNSETIFF, IFF_TAP_NO_PI = 0x400454CA, 0x1002


def run(*words):
    subprocess.run(words, check=True)


class End:
    """One namespace, its interface, and the packets under way to it."""

    def __init__(self, name, address):
        self.name = f"{name}-{os.getpid()}"
        self.device = f"{name[:3]}{os.getpid()}"
        run("ip", "netns", "add", self.name)
        self.file = os.open("/dev/net/tun", os.O_RDWR | os.O_NONBLOCK)
        fcntl.ioctl(self.file, TUNSETIFF, struct.pack("16sH22s", self.device.encode(), IFF_TAP_NO_PI, b""))
        run("ip", "link", "set", self.device, "netns", self.name)
        inside = ("ip", "-n", self.name)
        run(*inside, "link", "set", "lo", "up")
        run(*inside, "addr", "add", address, "dev", self.device)
        run(*inside, "link", "set", self.device, "up", "multicast", "on")
        run(*inside, "route", "add", "239.0.0.0/8", "dev", self.device)
        self.coming = collections.deque()

    def start(self, command, output=None):
        return subprocess.Popen(["ip", "netns", "exec", self.name, *shlex.split(command)], stdout=output, stderr=output)

    def remove(self):
        os.close(self.file)
        subprocess.run(["ip", "netns", "delete", self.name])


class Link:
    """What the packets between both ends go through."""

    def __init__(self, delay_ms=25.0, jitter_ms=0.0, loss=0.0, seed=1, outage=None):
        """outage: (first, last) second after the client's start between which nothing gets through."""
        self.delay_ms, self.jitter_ms, self.loss, self.outage = delay_ms, jitter_ms, loss, outage
        self.draw = random.Random(seed)
        self.packets, self.lost, self.worst_s = 0, 0, 0.0

    def loses(self, since_s):
        if self.outage and self.outage[0] <= since_s < self.outage[1]:
            return True
        return self.draw.random() < self.loss

    def fly(self, server_command, client_command, output=None):
        """Runs the server, 3 s later the client, and ends with it. Returns its exit code. output: a file for both."""
        ends, server, client, started = [], None, None, None
        try:
            for name, address in (("server", "10.77.0.1/24"), ("drone", "10.77.0.2/24")):
                ends.append(End(name, address))
            other = {ends[0].file: ends[1], ends[1].file: ends[0]}
            server = ends[0].start(server_command, output)
            begin = time.monotonic()
            while client is None or client.poll() is None:
                now = time.monotonic()
                if client is None and now - begin > 3.0:
                    client, started = ends[1].start(client_command, output), now
                due = min((end.coming[0][0] for end in ends if end.coming), default=now + 0.05)
                ready, _, _ = select.select(list(other), [], [], max(0.0, min(0.05, due - now)))
                now = time.monotonic()
                for file in ready:
                    self.take(file, other[file].coming, now, now - started if started else 0.0)
                for end in ends:
                    while end.coming and end.coming[0][0] <= now:
                        due, packet = end.coming.popleft()
                        self.worst_s = max(self.worst_s, now - due)
                        os.write(end.file, packet)
            return client.returncode
        finally:
            for process in (client, server):
                if process is not None and process.poll() is None:
                    process.send_signal(signal.SIGINT)
                    try:
                        process.wait(5)
                    except subprocess.TimeoutExpired:
                        process.kill()
            for end in ends:
                end.remove()

    def take(self, file, queue, now, since_s):
        """All packets that wait in the file go into the queue, or are lost."""
        try:
            while True:
                packet = os.read(file, 65536)
                self.packets += 1
                if self.loses(since_s):
                    self.lost += 1
                    continue
                held_s = 1e-3 * (self.delay_ms + self.draw.random() * self.jitter_ms)
                queue.append((max(now + held_s, queue[-1][0] if queue else 0.0), packet))
        except BlockingIOError:
            pass


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--delay-ms", type=float, default=25.0)
    parser.add_argument("--jitter-ms", type=float, default=0.0)
    parser.add_argument("--loss", type=float, default=0.0)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--server", required=True)
    parser.add_argument("--client", required=True)
    options = parser.parse_args()
    link = Link(options.delay_ms, options.jitter_ms, options.loss, options.seed)
    code = link.fly(options.server, options.client)
    print(f"slow link: {link.packets} packets, {link.lost} lost, held {1e3 * link.worst_s:.1f} ms too long at worst")
    return code


if __name__ == "__main__":
    sys.exit(main())
