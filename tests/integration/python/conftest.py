import fcntl
import os
import subprocess
import tempfile
import time
from pathlib import Path

import pytest

BUILD = Path(os.environ["GATEFIELD_BINARY_DIR"])
locks = []


def own_domain():
    """A DDS domain for this process, as tests/support/dds_domain.h has it; GATEFIELD_TEST_DOMAIN names another one."""
    if "GATEFIELD_TEST_DOMAIN" in os.environ:
        return int(os.environ["GATEFIELD_TEST_DOMAIN"])
    for i in range(90):
        domain = 10 + (os.getpid() + i) % 90
        lock = open(Path(tempfile.gettempdir()) / f"gatefield-test-domain-{domain}", "w")
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            continue
        locks.append(lock)
        return domain
    pytest.fail("all domains are in use")


@pytest.fixture(scope="session")
def domain():
    return own_domain()


@pytest.fixture(scope="session")
def empty_domain():
    """One that has no server."""
    return own_domain() if "GATEFIELD_TEST_DOMAIN" not in os.environ else int(os.environ["GATEFIELD_TEST_DOMAIN"]) + 1


@pytest.fixture(scope="session")
def server(domain, tmp_path_factory):
    """gatefield-server in `domain`."""
    log = tmp_path_factory.mktemp("server") / "server.log"
    with open(log, "w") as output:
        process = subprocess.Popen([BUILD / "bin/gatefield-server", "--domain", str(domain), "--name", "python-test"],
                                   stdout=output, stderr=subprocess.STDOUT)
    try:
        deadline = time.monotonic() + 120
        while "ready: server" not in log.read_text():
            assert process.poll() is None and time.monotonic() < deadline, log.read_text()
            time.sleep(0.1)
        yield process
    finally:
        process.terminate()
        try:
            process.wait(20)
        except subprocess.TimeoutExpired:
            process.kill()
