"""What tests/e2e/test_exhaustion.py does, with every allocation of every kind of request, one and three at a time."""
import os

import exhaustion
import harness

STEP = max(1, round(1 / float(os.environ.get("SOAK", "1"))))


def soak_memory_runs_out():
    if harness.SLOW > 1:
        return "not under a sanitizer, which has an allocator of its own"
    failing, faults, sent, refused = exhaustion.Failing(), [], 0, 0
    for reserve, count in ((False, 1), (False, 3), (True, 1), (True, 20)):
        with harness.Server(environment=failing.environment(reserve), prepared_cache_bytes=0, workers=1, runners=1, http_threads=1) as server:
            sweep = exhaustion.Sweep(server, failing)
            for name, request in exhaustion.kinds().items():
                sweep.run(name, request, STEP * (7 if name == "flow" else 1), count)  # steps of a flow are alike
            faults += sweep.faults
            sent, refused = sent + sweep.sent, refused + sweep.refused
            server.wait_metric("gnpd_queue_bytes", 0)
            server.wait_metric("gnpd_connections", 1)
    assert not faults, "%d faults, the first: %s" % (len(faults), faults[0])
    return "%d requests without some of their memory, %d were told so" % (sent, refused)
