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


def test_memory_runs_out_under_jobs():
    """A job that was acknowledged ends, with its answer or with the reason why there is none."""
    if harness.SLOW > 1:
        return
    failing = exhaustion.Failing()
    request = exhaustion.kinds()["ply"].replace(b"POST /v1/", b"POST /v1/jobs/", 1)
    states = {"succeeded": 0, "failed": 0}
    with harness.Server(environment=failing.environment(False), workers=1, runners=1, job_runners=1, http_threads=1) as server:
        for number in range(0, 1200, 29):
            failing.fail(number, 1)
            try:
                with server.connect() as s:
                    s.sendall(request)
                    answer = harness.read_response(s, "POST")
            except (ConnectionError, OSError, IndexError) as fault:
                assert not isinstance(fault, TimeoutError), number
                continue
            finally:
                time.sleep(0.02)  # what the job itself asks for fails as well
                failing.stop()
            assert answer.status in (202, 503), (number, answer.status, answer.text)
            if answer.status != 202:
                continue
            job = server.request("GET", answer.headers["location"] + "?wait=10s").json
            assert job["state"] in states, (number, job)
            assert job["state"] == "succeeded" or job["error"]["code"] == "out_of_memory", (number, job)
            states[job["state"]] += 1
        assert states["succeeded"] > 3, states


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
    with harness.Server(environment=failing.environment(reserve), prepared_cache_bytes=0, workers=1, runners=1, http_threads=1) as server:
        before = abuse.settle(server)
        silent_connections(server, failing)
        sweep = exhaustion.Sweep(server, failing)
        for i, (name, request) in enumerate(exhaustion.kinds().items()):
            sweep.run(name, request, SHARE, 1 + 2 * (i % 2), first=i % SHARE)
        assert not sweep.faults, "%d faults, the first: %s" % (len(sweep.faults), sweep.faults[0])
        assert failing.failed > 0 and (reserve or sweep.refused > 50)
        abuse.check_given_back(server, before, 128 << 20)
