"""The short forms of abuse.py; the long ones are in tests/soak."""
import signal

import abuse
import harness
from harness import SLOW

FEW = 1 if SLOW == 1 else 3


def test_a_thousand_connections_come_and_go():
    with harness.Server() as server:
        abuse.come_and_go(server, 50)
        before = abuse.settle(server)
        abuse.come_and_go(server, 1000 // FEW)
        abuse.check_given_back(server, before)


def test_slow_readers_are_cut():
    with harness.Server(reply_seconds=1, idle_seconds=1, workers=2) as server:
        before = abuse.settle(server)
        abuse.slow_readers(server, 6, 1)
        abuse.check_given_back(server, before, 256 << 20)


def test_clients_that_vanish_together():
    with harness.Server(workers=2, runners=4, queue_count=40) as server:
        abuse.vanish(server, 4)
        before = abuse.settle(server)
        abuse.vanish(server, 16)
        abuse.check_given_back(server, before, 128 << 20)


def test_mixed_clients_get_the_idle_answers():
    with harness.Server() as server:
        abuse.mixed_clients(server, 10, 0.5)
        before = abuse.settle(server)
        assert abuse.mixed_clients(server, 20, 3) > 100 / SLOW
        abuse.check_given_back(server, before, 64 << 20)


def test_overload_is_refused_and_work_goes_on():
    with harness.Server(runners=2, queue_count=3) as server:
        before = abuse.settle(server)
        peak, rate, refused = abuse.overload(server, 2, 3, 1)
        print("overload: %.1f a second at the peak, %.1f with ten times the clients, %d refused" % (peak, rate, refused))
        assert rate > 0.6 * peak, "%.1f a second under overload, %.1f before" % (rate, peak)
        abuse.check_given_back(server, before, 256 << 20)


def test_ready_connections_are_not_passed_over():
    with harness.Server(http_threads=1, workers=2) as server:
        worst = abuse.beside_suspended(server, 64, 1.5)
        assert worst < 0.25 * SLOW, "health beside suspended connections took %.3f s" % worst


def test_any_number_of_connections_may_be_ready_at_once():
    """The library asks for 128 events at a time: as many, and no more, are no reason to wait for others."""
    for count in (127, 128, 256):
        with harness.Server(http_threads=1, workers=1) as server:
            kept = [server.connect(5 * SLOW) for _ in range(count)]
            for s in kept:
                assert abuse.exchange(s, abuse.HEALTH).status == 200
            server.process.send_signal(signal.SIGSTOP)
            for s in kept:
                s.sendall(abuse.HEALTH)
            server.process.send_signal(signal.SIGCONT)
            for s in kept:
                assert harness.read_response(s).status == 200, "%d connections" % count


def test_memory_goes_back_when_there_is_nothing_to_do():
    if SLOW > 1:
        return  # a sanitizer keeps what was freed
    with harness.Server(workers=2) as server:
        before = abuse.settle(server)
        with server.connect(60) as s:
            assert abuse.exchange(s, abuse.estimate_request(100_000, quantities="all")).status == 200
        grown = abuse.settle(server)
        assert grown.resident > before.resident + (20 << 20), "%s, before %s: nothing that could go back" % (grown, before)
        harness.eventually(lambda: abuse.Holdings(server).resident < before.resident + (10 << 20), 15, "the memory of before")


def test_the_end_in_every_state():
    for state in abuse.states():
        for drain_seconds in (0, 0.5):
            abuse.end_in(state, drain_seconds)


def test_hangups_under_load():
    with harness.Server() as server:
        abuse.hangup_storm(server, 100, 6, 1.5)


def test_little_memory():
    """FLANN wrote to the address 0 when its pool of nodes found no memory."""
    if SLOW > 1:
        return  # a sanitizer ends the process when it finds no address space for itself
    for megabytes in (4, 20):
        with harness.Server(workers=2) as server:
            counts = abuse.little_memory(server, megabytes << 20, 8, 0.6, 50_000)
            assert counts[200] > 0 and counts[503] > 0, counts


def test_no_more_files():
    """Accepting must not spin while there is no descriptor for it."""
    with harness.Server(workers=2) as server:
        share = max(abuse.no_more_files(server, more) for more in (0, 5))
        assert SLOW > 1 or share < 0.6, "%.0f %% of a processor while no file can be opened" % (100 * share)
