"""What tests/e2e/test_abuse.py does, at length."""
import os
import time

import abuse
import harness
import test_hostile
from harness import SLOW

STRETCH = float(os.environ.get("SOAK", "1"))
FEW = 1 if SLOW == 1 else 4


def soak_connections_that_come_and_go():
    count = int(10_000 * STRETCH / FEW)
    with harness.Server() as server:
        abuse.come_and_go(server, 500)
        before = abuse.settle(server)
        abuse.come_and_go(server, count)
        return "%d connections: %s, before %s" % (count, abuse.check_given_back(server, before), before)


def soak_slow_senders():
    """Headers and bodies a byte a second, with others served meanwhile."""
    half = 400 // FEW
    header = b"GET /v2 HTTP/1.1\r\nHost: localhost\r\nX-Slow: "
    body = b"POST /v1/estimate HTTP/1.1\r\nHost: localhost\r\nContent-Length: 100000\r\n\r\n"
    with harness.Server(header_seconds=8, body_grace_seconds=6, min_body_rate=1000, max_connections=2000) as server:
        before = abuse.settle(server)
        dribbler = test_hostile.Dribbler(server, [header] * half + [body] * half)
        dribbler.start()
        worst, until = 0.0, time.monotonic() + 5
        while time.monotonic() < until:
            worst = max(worst, test_hostile.worst_health(server, 3))
            with server.connect() as s:
                assert abuse.exchange(s, abuse.estimate_request(300)).status == 200
        harness.eventually(lambda: dribbler.closed == 2 * half, 15, "the end of all slow senders")
        dribbler.join()
        assert worst < 0.1 * SLOW, "health took %.3f s" % worst
        return "%d of them: health took %.3f s at most; %s, before %s" % (2 * half, worst, abuse.check_given_back(server, before), before)


def soak_slow_readers():
    with harness.Server(reply_seconds=5, idle_seconds=5, workers=2) as server:
        before = abuse.settle(server)
        abuse.slow_readers(server, 60 // FEW, 5)
        return "%s, before %s" % (abuse.check_given_back(server, before), before)


def soak_clients_that_vanish():
    rounds, worst = max(1, int(20 * STRETCH)), 0.0
    with harness.Server(workers=2, runners=8, queue_count=100) as server:
        abuse.vanish(server, 10)
        before = abuse.settle(server)
        for _ in range(rounds):
            worst = max(worst, abuse.vanish(server, 40 // FEW))
        after = abuse.check_given_back(server, before)
    return "%d times %d clients: all was free again after %.2f s at most; %s, before %s" % (rounds, 40 // FEW, worst, after, before)


def soak_mixed_clients():
    seconds = 60 * STRETCH
    with harness.Server(queue_count=400, max_connections=500) as server:
        abuse.mixed_clients(server, 200 // FEW, min(10, seconds))
        before = abuse.settle(server)
        count = abuse.mixed_clients(server, 200 // FEW, seconds)
        after = abuse.check_given_back(server, before)
    return "%d answers to %d clients, each as on an idle server; %s, before %s" % (count, 200 // FEW, after, before)


def soak_overload():
    with harness.Server(runners=2, queue_count=6) as server:
        before = abuse.settle(server)
        peak, rate, refused = abuse.overload(server, 2, 6, 20 * STRETCH)
        after = abuse.check_given_back(server, before)
    assert SLOW > 1 or rate > 0.9 * peak, "%.1f a second under overload, %.1f at the peak" % (rate, peak)
    return "%.1f a second at the peak, %.1f with ten times the clients, %d refused; %s, before %s" % (peak, rate, refused, after, before)


def soak_ready_connections_beside_suspended_ones():
    with harness.Server(http_threads=1, workers=2) as server:
        worst = abuse.beside_suspended(server, 200, 30 * STRETCH)
    assert worst < 0.5 * SLOW, "health beside suspended connections took %.3f s" % worst
    return "100 health answers on one thread took %.3f s at most" % worst


def soak_the_end_in_every_state():
    worst = {}
    for drain_seconds in (0, 0.5, 3):
        for state in abuse.states():
            for _ in range(max(1, int(2 * STRETCH))):
                over = abuse.end_in(state, drain_seconds) - drain_seconds
                worst[state] = max(worst.get(state, 0), over)
    state = max(worst, key=worst.get)
    return "at most %.2f s after the time to drain (%s)" % (worst[state], state)


def soak_hangups_under_load():
    with harness.Server() as server:
        before = abuse.settle(server)
        count = abuse.hangup_storm(server, int(3000 * STRETCH), 20, 30 * STRETCH)
        return "%d answers meanwhile; %s, before %s" % (count, abuse.check_given_back(server, before), before)


def soak_little_memory():
    if SLOW > 1:
        return "not under a sanitizer, which ends the process when it finds no address space for itself"
    said = []
    for megabytes in (2, 8, 20, 40, 60, 80, 120):
        with harness.Server(workers=2) as server:
            counts = abuse.little_memory(server, megabytes << 20, 12, 5 * STRETCH)
            abuse.settle(server)
        said.append("%d MB: %d answered, %d refused, %d dropped" % (megabytes, counts[200], counts[503], counts["dropped"]))
    return "; ".join(said)


def soak_no_more_files():
    share = 0.0
    with harness.Server(workers=2) as server:
        for more in range(0, 40, 4):
            share = max(share, abuse.no_more_files(server, more))
    assert SLOW > 1 or share < 0.6, "%.0f %% of a processor while no file can be opened" % (100 * share)
    return "at most %.0f %% of a processor meanwhile" % (100 * share)
