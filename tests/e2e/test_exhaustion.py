"""Memory runs out at any moment of a request: the daemon says so or drops the connection, loses nothing, and goes on."""
import time

import abuse
import exhaustion
import harness

SHARE = 79


def test_memory_runs_out_in_every_kind_of_request():
    """Long form: tests/soak/exhaustion.py, every allocation. FLANN threw std::bad_alloc through its C interface, jansson failed an
    assertion or read another text, libzip's want of memory was the client's fault, and a digest ran over the end of its text."""
    if harness.SLOW > 1:
        return  # a sanitizer has an allocator of its own; test_exhaustion.c is its test
    for reserve in (False, True):
        sweep_all(reserve)


def silent_connections(server, failing):
    """One for which there was no memory was watched over by nobody: it could stay for ever without a word. It is closed, or it works."""
    for number in range(8):
        failing.fail(number, 1)
        with server.connect(5) as s:
            time.sleep(0.02)
            failing.stop()
            s.settimeout(0.05)
            try:
                assert s.recv(1) == b""
                continue
            except ConnectionError:
                continue
            except TimeoutError:
                s.settimeout(5)
            s.sendall(abuse.HEALTH)
            assert harness.read_response(s).status == 200


def sweep_all(reserve):
    failing = exhaustion.Failing()
    with harness.Server(environment=failing.environment(reserve), operator_cache_bytes=0, workers=1, runners=1, http_threads=1) as server:
        before = abuse.settle(server)
        silent_connections(server, failing)
        sweep = exhaustion.Sweep(server, failing)
        for i, (name, request) in enumerate(exhaustion.kinds().items()):
            sweep.run(name, request, SHARE, 1 + 2 * (i % 2), first=i % SHARE)
        assert not sweep.faults, "%d faults, the first: %s" % (len(sweep.faults), sweep.faults[0])
        assert failing.failed > 0 and (reserve or sweep.refused > 50)
        abuse.check_given_back(server, before, 128 << 20)
