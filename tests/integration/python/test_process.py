"""Signals, forks, sub-interpreters, the end of a program: each in a process of its own."""

import os
import signal
import subprocess
import sys
import time

import pytest

SLACK_S = 0.1  # from a signal to the exception


def start(program, *arguments):
    return subprocess.Popen([sys.executable, "-c", program, *map(str, arguments)], stdout=subprocess.PIPE,
                            stderr=subprocess.STDOUT, text=True)


def said(process, timeout=60):
    try:
        return process.communicate(timeout=timeout)[0]
    finally:
        process.kill()


JOIN = """
import gatefield, sys, time
course = gatefield.Course([gatefield.Waypoint((5, 0, 1.5), (1, 0, 0))], closed=False)
def join(name="process", **more):
    return gatefield.connect(course, vehicle=name, domain=int(sys.argv[1]), timing="lockstep", **more)
"""

CONNECTING = JOIN + """
print("waiting", flush=True)
try:
    join(timeout_s=60)
except KeyboardInterrupt:
    print("interrupted", time.monotonic(), flush=True)
"""

WAITING = JOIN + """
with join(timeout_s=30) as client:
    print("waiting", flush=True)
    try:
        client.wait_for_answer(10**6, timeout_s=60)
    except KeyboardInterrupt:
        print("interrupted", time.monotonic(), flush=True)
"""


def interrupted_after_s(program, domain):
    process = start(program, domain)
    assert process.stdout.readline() == "waiting\n", said(process)
    time.sleep(0.5)
    sent = time.monotonic()
    process.send_signal(signal.SIGINT)
    words = said(process).split()
    assert words[0] == "interrupted" and process.returncode == 0, words
    return float(words[1]) - sent


@pytest.mark.parametrize("program", [CONNECTING, WAITING])
def test_control_c_ends_it(server, domain, empty_domain, program):
    """The best of five: a machine that is busy with other things says nothing."""
    took_s = min(interrupted_after_s(program, empty_domain if program == CONNECTING else domain) for _ in range(5))
    assert took_s < SLACK_S


FORKED = JOIN + """
import os
client = join(timeout_s=30)
def words(call):
    try:
        call()
        return "nothing was said"
    except gatefield.Unsupported as refused:
        return refused.sentence
child = os.fork()
if child == 0:
    print(words(lambda: client.statistics()), flush=True)
    print(words(lambda: join("child")), flush=True)
    print(words(lambda: gatefield.find_servers(0)), flush=True)
    client.close()
    del client
    sys.exit(7)
assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 7
print("parent", client.session.server, flush=True)
client.close()
"""


def test_a_fork_after_connect_is_refused_and_the_parent_flies_on(server, domain):
    process = start(FORKED, domain)
    lines = said(process).splitlines()
    assert process.returncode == 0, lines
    assert len(lines) == 4 and all("forked" in line and "spawn" in line for line in lines[:3]), lines
    assert lines[3] == "parent python-test"


def test_a_fork_before_connect_is_a_process_like_any_other(server, domain):
    program = JOIN + """
import os
child = os.fork()
if child == 0:
    join("child", timeout_s=30).close()
    sys.exit(7)
print(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]))
"""
    assert said(start(program, domain)) == "7\n"


def test_sub_interpreters_are_refused():
    program = """
import gatefield
try:
    import _xxsubinterpreters as interpreters
except ImportError:
    import _interpreters as interpreters
inner = interpreters.create()
result = interpreters.run_string(inner, "import gatefield")
if result is not None:
    raise RuntimeError(str(result))
"""
    words = said(start(program))
    assert "ImportError" in words and "sub-interpreter" in words, words


def test_a_program_that_ends_with_open_sessions_ends(server, domain):
    program = JOIN + "clients = [join(f'open-{i}', timeout_s=30) for i in range(2)]\nprint('ends')"
    process = start(program, domain)
    assert said(process) == "ends\n" and process.returncode == 0


def test_the_server_that_goes_is_told(domain, tmp_path):
    """One of its own, which is ended: the session is lost, with its words."""
    build = os.environ["GATEFIELD_BINARY_DIR"]
    own = subprocess.Popen([f"{build}/bin/gatefield-server", "--domain", str(domain), "--name", "leaving"],
                           stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    try:
        program = JOIN + """
with join(timeout_s=60, server="leaving") as client:
    print("joined", flush=True)
    while not (changes := client.session_changes()):
        client.send_state(gatefield.now(), gatefield.State(p_WB=(0, 0, 1)))
        time.sleep(0.02)
    print(changes[0].kind, changes[0].why, changes[0].server, bool(changes[0].sentence))
"""
        process = start(program, domain)
        assert process.stdout.readline() == "joined\n"
        own.terminate()
        assert said(process) == "lost leaving leaving True\n"
    finally:
        own.kill()
        own.wait()
