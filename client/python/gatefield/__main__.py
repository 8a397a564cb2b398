"""python3 -m gatefield: says which version this is, and which servers a DDS domain has.

python3 -m gatefield import KIND FILE --out FILE: reads courses, vehicles and calibrations of others (importing/).
"""

import argparse
import sys

import gatefield
from gatefield import _gatefield


def arguments():
    parser = argparse.ArgumentParser(
        prog="python3 -m gatefield",
        description="Says which version this is and finds the planning servers of a DDS domain.",
        epilog="Exit code: 0 a server was found, 1 none answered, 2 the network can't be used as told. "
        "Example: python3 -m gatefield --domain 7 --peer 10.0.0.7. `python3 -m gatefield import --help`: courses and "
        "vehicles of others as Gatefield files.")
    parser.add_argument("--version", action="store_true", help="say the version and end")
    parser.add_argument("--domain", type=int, default=0, metavar="N", help="DDS domain, 0 to 232 (default: 0)")
    parser.add_argument("--wait", type=float, default=1.5, metavar="S",
                        help="seconds to listen; servers say four times a second that they are there (default: 1.5)")
    parser.add_argument("--peer", action="append", default=[], metavar="HOST",
                        help="a host that is called beside multicast; may be given several times")
    parser.add_argument("--interface", action="append", default=[], metavar="NAME",
                        help="network interface to use, by name or address; may be given several times")
    parser.add_argument("--discovery-server", action="append", default=[], metavar="HOST:PORT",
                        help="where a discovery server listens; may be given several times")
    parser.add_argument("--security", default="", metavar="FOLDER",
                        help="a tool's folder, in a closed domain (gatefield-keys tool NAME)")
    return parser.parse_args()


def main():
    if sys.argv[1:2] == ["import"]:
        from gatefield.importing import command
        return command.main(sys.argv[2:])
    asked = arguments()
    print(f"gatefield {gatefield.__version__}, wire version {_gatefield.WIRE_VERSION}")
    if asked.version:
        return 0
    network = gatefield.Network(asked.peer, asked.interface, asked.discovery_server, security=asked.security)
    try:
        servers = gatefield.find_servers(asked.domain, asked.wait, network)
    except gatefield.Refused as refused:
        print(f"gatefield: {refused.sentence}", file=sys.stderr)
        return 2
    for server in servers:
        room = f"room for {server.room_cores:.2f} cores of work" if server.accepts else "takes nobody now"
        print(f"{server.name}: {server.sessions} vehicles, {room}, {server.isa}, model {server.model_hash}")
        if server.wire_version != _gatefield.WIRE_VERSION:
            print(f"  speaks version {server.wire_version} of the wire, and refuses this client")
    if not servers:
        print(f"no server in domain {asked.domain} within {asked.wait:g} s; start gatefield-server, or name its host "
              "with --peer")
    return 0 if servers else 1


if __name__ == "__main__":
    try:
        sys.exit(main())
    except KeyboardInterrupt:
        sys.exit(130)
