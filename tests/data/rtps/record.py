#!/usr/bin/env python3
"""Records RTPS packets of a DDS domain while a command runs, and keeps a few of each shape: which submessages of which
kinds of writers they hold, and for fragments whether they begin a sample. Needs root (a packet socket). Linux only.

  record.py --domain 7 --out packets.hex -- COMMAND

recorded.hex was made with a lossy link between server and simulator, so that there are repairs in it:

  tests/link/slow_link.py --delay-ms 5 --loss 0.05 \\
    --server "tests/data/rtps/record.py --domain 7 --out tests/data/rtps/recorded.hex -- \\
              build/release/bin/gatefield-server --domain 7" \\
    --client "build/release/bin/gatefield-sim --domain 7 --realtime --scenario circle-0.3m --speed 5 --laps 1"

Form: for each packet a line "# its submessages", then its bytes in hexadecimal, then an empty line.
"""
import argparse
import collections
import select
import shlex
import signal
import socket
import struct
import subprocess
import sys

NAMES = {0x01: "PAD", 0x06: "ACKNACK", 0x07: "HEARTBEAT", 0x08: "GAP", 0x09: "INFO_TS", 0x0c: "INFO_SRC",
         0x0e: "INFO_DST", 0x12: "NACK_FRAG", 0x13: "HEARTBEAT_FRAG", 0x15: "DATA", 0x16: "DATA_FRAG", 0x80: "STATISTICS"}
ENTITY_AT = {0x06: 4, 0x07: 4, 0x08: 4, 0x12: 4, 0x13: 4, 0x15: 8, 0x16: 8}  # of the writer, in the submessage's body
OF_A_SHAPE = 2
ETH_P_ALL, ETH_P_IP, IP_UDP = 0x0003, 0x0800, 17


def shape(packet):
    """Its submessages in words; None: no RTPS."""
    if packet[:4] != b"RTPS":
        return None
    words, at = [], 20
    while at + 4 <= len(packet):
        kind, flags, length = struct.unpack_from("<BBH", packet, at)
        if kind not in NAMES:
            return None
        body = packet[at + 4:at + 4 + length]
        word = NAMES[kind]
        if kind in ENTITY_AT:
            word += f"/{body[ENTITY_AT[kind]:ENTITY_AT[kind] + 4].hex()}/{flags:x}"
        if kind == 0x16:
            word += "/first" if struct.unpack_from("<I", body, 20)[0] == 1 else ""
        words.append(word)
        at += 4 + length
    return " ".join(words)


def udp_payload(frame, first_port):
    """Of an Ethernet frame to or from one of the domain's 250 ports."""
    if len(frame) < 34 or struct.unpack_from(">H", frame, 12)[0] != ETH_P_IP or frame[23] != IP_UDP:
        return None
    udp = 14 + 4 * (frame[14] & 0x0f)
    ports = struct.unpack_from(">HH", frame, udp)
    return frame[udp + 8:] if any(first_port <= port < first_port + 250 for port in ports) else None


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--domain", type=int, required=True)
    parser.add_argument("--out", required=True)
    parser.add_argument("command", nargs=argparse.REMAINDER)
    arguments = parser.parse_args()
    command = arguments.command[1:] if arguments.command[:1] == ["--"] else arguments.command

    kept = collections.defaultdict(list)
    with socket.socket(socket.AF_PACKET, socket.SOCK_RAW, socket.htons(ETH_P_ALL)) as wire:
        child = subprocess.Popen(command)
        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, lambda *_: child.terminate())
        while child.poll() is None:
            if not select.select([wire], [], [], 0.2)[0]:
                continue
            packet = udp_payload(wire.recv(65536), 7400 + 250 * arguments.domain)
            words = packet and shape(packet)
            if words and len(kept[words]) < OF_A_SHAPE and packet not in kept[words]:
                kept[words].append(packet)
    with open(arguments.out, "w", encoding="ascii") as out:
        for words in sorted(kept):
            for packet in kept[words]:
                digits = packet.hex()
                lines = [digits[i:i + 96] for i in range(0, len(digits), 96)]
                out.write(f"# {words}"[:120] + "\n" + "\n".join(lines) + "\n\n")
    print(f"{shlex.join(command)}: {sum(map(len, kept.values()))} packets of {len(kept)} shapes", file=sys.stderr)
    return child.returncode


if __name__ == "__main__":
    sys.exit(main())
