"""Computations that end the process or never end, in tests/dying_gnpd, which is gnpd but for clouds of 61 and 62 points."""
import os
import signal
import time

import harness
from harness import Server, eventually
from test_jobs import CLOUD, LONG, QUICK, delete, finished, folder, running, submit
from test_jobs_restart import DIED_TWICE, kill

DYING = os.path.join(os.path.dirname(harness.BINARY), "tests", "dying_gnpd")
DIES, HANGS = (harness.ply(harness.sphere(count)) for count in (61, 62))


def start(path, **flags):
    return Server(program=DYING, jobs_dir=path, jobs_checkpoint_seconds=0.1, **flags)


def dies(server):
    assert server.wait(20) == -signal.SIGABRT, server.log()
    server.kill()


def dies_again(path):
    """By itself, perhaps before it said that it was ready."""
    try:
        server = start(path)
    except AssertionError as fault:
        assert "did not start" in str(fault), fault
    else:
        dies(server)


def test_a_job_that_ends_the_process_does_so_twice_and_takes_no_other_with_it():
    """It ran with others until it was given up, and they were given up with it."""
    with folder() as path:
        server = start(path)
        innocent = submit(server, LONG)
        running(server, innocent)
        try:
            submit(server, QUICK, DIES)
        except ConnectionError:  # the process ended before its answer was sent; the job is on disk
            pass
        dies(server)
        dies_again(path)
        with start(path) as server:
            killer, = (job["id"] for job in server.get("/v1/jobs").json["jobs"] if job["id"] != innocent)
            waiting = submit(server)
            record = finished(server, killer)
            assert record["state"] == "failed" and record["error"]["code"] == "internal" and DIED_TWICE in record["error"]["text"], record
            assert "job %s: failed: the process died 2 times" % killer in server.log()
            assert finished(server, waiting)["state"] == "succeeded"
            running(server, innocent)
            assert server.metric("gnpd_jobs_resumed_total") >= 1 and server.metric("gnpd_jobs_suspects") == 0
            delete(server, innocent)


def test_a_request_that_ends_the_process_takes_no_job_with_it():
    with folder() as path:
        jobs = []
        for death in range(3):
            server = start(path)
            jobs += [submit(server, "flow?estimator=gmls&steps=150&dt=1e-5")]
            try:
                server.post("/v1/" + QUICK, DIES)
                raise AssertionError("an answer")
            except ConnectionError:
                dies(server)
        with start(path, jobs_attempts=2) as server:
            ends = [finished(server, job, 60)["state"] for job in jobs]
            assert ends == ["succeeded"] * 3, ends


def attempts(path, job):
    with open(os.path.join(path, job + ".job")) as file:
        return [line for line in file if line.startswith("attempts ")][0]


def test_a_job_that_does_not_hear_that_the_process_ends_has_not_ended_it():
    """Its run counted when it was killed for it, as a service manager does."""
    with folder() as path:
        server = start(path, jobs_attempts=1)
        job = submit(server, QUICK, HANGS)
        running(server, job)
        assert attempts(path, job) == "attempts 1\n"
        server.signal()
        eventually(lambda: attempts(path, job) == "attempts 0\n", what="no attempt")
        kill(server)
        server = start(path, jobs_attempts=1)
        running(server, job)
        kill(server)
        with start(path, jobs_attempts=1) as server:
            record = server.get("/v1/jobs/" + job).json
            assert record["state"] == "failed" and "the process died 1 time while this job ran (jobs-attempts: 1)" in record["error"]["text"], record


def test_work_that_does_not_end_does_not_keep_the_process():
    """It waited for it for ever."""
    with folder() as path:
        server = start(path, drain_seconds=0.1)
        job = submit(server, QUICK, HANGS)
        running(server, job)
        with server.connect() as connection:
            connection.sendall(harness.make_request("POST", "/v1/" + QUICK, HANGS))
            eventually(lambda: server.metric("gnpd_running_requests") >= 1, what="under way")
            began = time.monotonic()
            server.signal()
            assert server.wait(20) == 1 and time.monotonic() - began < 9 * harness.SLOW
        assert "1 requests and 1 jobs did not end within 5 s" in server.log(), server.log()
        server.kill()
