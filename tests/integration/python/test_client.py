"""The package against the real server, over DDS."""

import subprocess
import sys
import threading
import time

import numpy as np
import pytest

import gatefield

COURSE = gatefield.Course([gatefield.Waypoint((5, 0, 1.5), (1, 0, 0))], closed=False)
HOVER = gatefield.State(p_WB=(0, 0, 1.5), thrust_n=[2.0356] * 4, thrust_command_n=[2.0356] * 4)
SECOND = 1_000_000_000


def join(domain, vehicle="python", **options):
    options = {"timing": "lockstep", "timeout_s": 30, **options}
    return gatefield.connect(COURSE, vehicle=vehicle, domain=domain, **options)


@pytest.fixture
def client(server, domain):
    with join(domain) as joined:
        yield joined


def ask(client, stamp=SECOND, depth=None):
    client.send_depth(stamp, np.full((90, 160), 3, np.float32) if depth is None else depth)
    return client.wait_for_answer(client.send_state(stamp, HOVER), timeout_s=20)


def test_a_plan_as_arrays(client):
    plan = ask(client)
    assert plan.answers_stamp == SECOND and plan.steps == len(plan.stamps) > 1
    assert plan.rotor_thrust_n.shape == plan.thrust_rate_n_s.shape == (plan.steps, 4)
    assert plan.body_rates_rad_s.shape == (plan.steps, 3)
    np.testing.assert_allclose(plan.collective_thrust_n, plan.rotor_thrust_n.sum(axis=1), rtol=1e-4)
    assert np.diff(plan.stamps).tolist() == [plan.step] * (plan.steps - 1)
    assert plan.actuation == "rotor_thrusts" and plan.health.solve_time_s > 0
    assert "rotor_thrust_n" not in repr(plan) and f"steps={plan.steps}" in repr(plan)

    thrusts = plan.rotor_thrust_n  # a view, which nobody may write and which outlives the rest
    assert not thrusts.flags.owndata and not thrusts.flags.writeable
    before = thrusts.copy()
    del plan
    np.testing.assert_array_equal(thrusts, before)


def test_the_plan_is_played_then_the_fallback_flies(client):
    plan = ask(client)
    setpoint = client.play(SECOND, HOVER, 10_000_000)
    assert setpoint.source == "plan" and setpoint.rotor_thrust_n.shape == (4,)
    assert setpoint.collective_thrust_n == pytest.approx(setpoint.rotor_thrust_n.sum())
    assert client.play(plan.start + plan.validity + SECOND, HOVER, 10_000_000).source == "fallback"


def test_what_the_session_is(client, server):
    assert client.session.server == "python-test" and 0 < client.session.control_period_s < 0.1
    ask(client)
    assert client.newest().answers_stamp == SECOND and client.newest() is None
    statistics = client.statistics()
    assert statistics.commands >= 1 and statistics.round_trip_p50_s > 0
    deadline = time.monotonic() + 10
    while (telemetry := client.telemetry()) is None or telemetry.states_received == 0:
        assert time.monotonic() < deadline
        time.sleep(0.05)
    assert telemetry.last_reason == "" and telemetry.frames_received == 1
    assert client.session_changes() == []
    assert "python-test" in repr(client)


@pytest.mark.parametrize("depth", [
    np.full((90, 160), 3000, np.uint16), np.full((90, 160), 3, np.float32), np.full(90 * 160, 3, np.float32),
    np.full((90, 160, 1), 3, np.float32), np.full((90, 160), 3.0), np.full((90, 160), 3, np.float16),
    np.full((180, 320), 3000, np.uint16)[::2, ::2], np.asfortranarray(np.full((90, 160), 3, np.float32)),
    np.full((90, 160), 3000, ">u2"), np.full((90, 160), 3, ">f4")
])
def test_images_that_are_taken(client, depth):
    assert client.send_depth(SECOND, depth) == 1


@pytest.mark.parametrize("depth, words", [
    (np.zeros((160, 90), np.float32), "shape (160, 90) and dtype float32, expected shape (90, 160)"),
    (np.zeros((90, 160), np.int32), "dtype int32"),
    (np.zeros((90, 160), np.uint8), "dtype uint8"),
    (np.zeros((90, 160), bool), "dtype bool"),
    (np.zeros((90, 160, 3), np.uint16), "shape (90, 160, 3)"),
    ([[1.0, 2.0]], "shape (1, 2) and dtype float64"),
    (None, "dtype object"),
])
def test_images_that_are_refused(client, depth, words):
    with pytest.raises(gatefield.Invalid) as caught:
        client.send_depth(SECOND, depth)
    assert caught.value.field == "depth" and words in caught.value.sentence


def test_an_image_as_it_lies_is_not_copied(client):
    """tracemalloc sees NumPy's memory: an image of the wrong order takes its size, one of the right order nothing."""
    import tracemalloc

    def taken(image):
        client.send_depth(SECOND, image)  # what is allocated once
        tracemalloc.start()
        client.send_depth(2 * SECOND, image)
        peak = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        return peak

    image = np.full((90, 160), 3, np.float32)
    assert taken(image) < 4000 < image.nbytes <= taken(np.asfortranarray(image))


def test_stamps_are_integers(client):
    with pytest.raises(gatefield.Invalid, match="nanoseconds as an integer") as caught:
        client.send_state(1.5, HOVER)
    assert caught.value.field == "stamp"
    assert client.send_state(np.int64(SECOND), HOVER) == 1
    with pytest.raises(gatefield.Invalid) as caught:
        client.send_state(SECOND, gatefield.State(q_WB_wxyz=(1, 0, 0)))
    assert caught.value.field == "state.q_WB_wxyz"


def test_refusals_carry_what_the_server_said(server, domain):
    with pytest.raises(gatefield.UnknownName) as caught:
        join(domain, profile="leisure")
    assert caught.value.field == "profile" and "race" in caught.value.expected and caught.value.sentence
    with join(domain, "twin") as twin:
        ask(twin)  # a name that says nothing for a second is free
        with pytest.raises(gatefield.Busy) as caught:
            join(domain, "twin", timeout_s=0.5)
        assert caught.value.code == "busy_name" and caught.value.may_pass


def test_problems_are_told(server, domain):
    """The velocity is not the position's change."""
    with join(domain) as client:
        found = []
        for k in range(200):
            stamp = SECOND + k * 20_000_000
            client.send_depth(stamp, np.zeros((90, 160), np.uint16))
            state = gatefield.State(p_WB=(0.02 * k, 0, 1.5), v_WB=(0, 3, 0), thrust_n=HOVER.thrust_n,
                                    thrust_command_n=HOVER.thrust_command_n)
            client.wait_for_answer(client.send_state(stamp, state), timeout_s=5)
            found += client.problem_changes()
            if any(change.problem == gatefield.Problem.velocity_against_motion and change.began for change in found):
                break
        else:
            pytest.fail(f"not found: {found}")
        assert gatefield.Problem.velocity_against_motion in client.problems()


def test_real_time_plans_come_by_themselves(server, domain):
    with join(domain, timing="real_time") as client:
        plans = 0
        deadline = time.monotonic() + 20
        while plans < 3 and time.monotonic() < deadline:
            client.send_state(gatefield.now(), HOVER)
            plans += client.newest() is not None
            time.sleep(0.02)
        assert plans == 3


def test_body_rates(server, domain):
    with join(domain, model="racer-rates") as client:
        depth = np.zeros((client._options.camera.height_px, client._options.camera.width_px), np.uint16)
        plan = ask(client, depth=depth)
        assert plan.actuation == "body_rates"
        setpoint = client.play(SECOND, HOVER, 10_000_000)
        assert setpoint.source == "plan" and setpoint.collective_thrust_n > 0 and not setpoint.rotor_thrust_n.any()
        client.applied(SECOND, gatefield.Setpoint(collective_thrust_n=8.1, body_rates_rad_s=(0, 0, 0)))
        client.applied(SECOND, None)


def counting(stop):
    count = [0]

    def work():
        while not stop.is_set():
            count[0] += 1

    thread = threading.Thread(target=work)
    thread.start()
    return thread, count


def test_other_threads_run_while_one_waits(client, empty_domain):
    """A thread that counts gets on in the same second in which connect() or wait_for_answer() waits."""
    for wait in (lambda: client.wait_for_answer(client.send_state(SECOND, gatefield.State(v_WB=[np.nan] * 3)), 1.0),
                 lambda: pytest.raises(gatefield.NoAnswer, join, empty_domain, timeout_s=1.0)):
        stop = threading.Event()
        thread, count = counting(stop)
        before = count[0]
        wait()
        counted = count[0] - before
        stop.set()
        thread.join()
        assert counted > 10_000


def test_threads_call_from_everywhere(client):
    failures = []

    def work(k):
        try:
            for turn in range(50):
                stamp = SECOND + (50 * k + turn) * 1_000_000
                client.send_depth(stamp, np.zeros((90, 160), np.uint16))
                client.wait_for_answer(client.send_state(stamp, HOVER), timeout_s=0.05)
                client.play(stamp, HOVER, 1_000_000)
                client.newest(), client.statistics(), client.telemetry(), client.problem_changes(), client.problems()
        except Exception as failure:
            failures.append(failure)

    threads = [threading.Thread(target=work, args=(k,)) for k in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert failures == []


def test_closing_ends_the_waits_of_other_threads(server, domain):
    client = join(domain, "closing")
    ended = []

    def wait():
        with pytest.raises(ValueError, match="closed"):
            client.wait_for_answer(10**6, timeout_s=60)
        ended.append(True)

    thread = threading.Thread(target=wait)
    thread.start()
    time.sleep(0.2)
    client.close()
    client.close()
    thread.join(10)
    assert ended == [True] and client.closed and "closed" in repr(client)


def test_servers_are_found(server, domain, empty_domain):
    found = gatefield.find_servers(domain, wait_s=5)
    assert [one.name for one in found] == ["python-test"] and found[0].accepts and found[0].isa
    assert gatefield.find_servers(empty_domain, wait_s=0.2) == []
    said = subprocess.run([sys.executable, "-m", "gatefield", "--domain", str(domain), "--wait", "5"],
                          capture_output=True, text=True)
    assert said.returncode == 0 and "python-test: " in said.stdout and gatefield.__version__ in said.stdout
    bad = subprocess.run([sys.executable, "-m", "gatefield", "--interface", "nowhere0"], capture_output=True, text=True)
    assert bad.returncode == 2 and "nowhere0" in bad.stderr


def test_two_hundred_joins_leave_nothing_behind(server, domain):
    """Descriptors and threads, counted after the first few, which set the library up."""

    def open_now():
        import os
        return len(os.listdir("/proc/self/fd")), len(os.listdir("/proc/self/task"))

    for _ in range(3):
        join(domain, "again").close()
    before = open_now()
    for _ in range(200):
        join(domain, "again").close()
    assert open_now() == before
