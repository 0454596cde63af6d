"""Jobs across processes: what was acknowledged is there afterwards, however the process ended."""
import io
import os
import time
import zipfile

import audit
import harness
from harness import Server, eventually
from test_jobs import CLOUD, LONG, QUICK, delete, finished, folder, running, submit

DIED_TWICE = "the process died 2 times while this job ran, at last with no other job beside it (jobs-attempts: 2)"
FLOW = "flow?estimator=gmls&steps=250&dt=1e-5&snapshot_every=40&format=npz"


def kill(server):
    """As a machine that loses its power, as far as a process can tell."""
    server.process.kill()
    server.process.wait()
    server.kill()


def flow_arrays(data):
    """The arrays of a flow's answer as NPZ, but for the seconds in the last column of its record."""
    arrays = {}
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        for name in archive.namelist():
            content = archive.read(name)
            length = 10 + int.from_bytes(content[8:10], "little")  # NPY 1.0
            arrays[name] = content[:length], content[length:]
    head, rows = arrays["record.npy"]
    assert b"'<f8'" in head and b", 10)" in head, head
    arrays["record.npy"] = head, b"".join(rows[i:i + 72] for i in range(0, len(rows), 80))
    return {name: array for name, array in arrays.items() if b"seconds" not in array[1] and "seconds" not in name}


def stepped(server, job):
    progress = server.get("/v1/jobs/" + job).json["progress"]
    return progress["step"] if progress["stage"] == "flow" else 0


def test_jobs_survive_a_restart():
    with folder() as path:
        with Server(jobs_dir=path, job_runners=1) as server:
            done = finished(server, submit(server))["id"]
            body = server.get("/v1/jobs/%s/result" % done).body
            blocking, waiting = submit(server, LONG), submit(server)
            running(server, blocking)
        with Server(jobs_dir=path, job_runners=1) as server:
            assert server.get("/v1/jobs/%s/result" % done).body == body
            assert [record["id"] for record in server.get("/v1/jobs").json["jobs"]] == [waiting, blocking, done]
            assert server.get("/v1/jobs/" + waiting).json["state"] == "queued", "in the order they came"
            assert server.metric("gnpd_jobs_recovered_total") == 2
            delete(server, blocking)
            assert finished(server, waiting)["state"] == "succeeded"


def test_sigterm_parks_a_flow_which_goes_on_where_it_was():
    with folder() as path:
        with Server(jobs_dir=path, drain_seconds=5) as server:
            wanted = flow_arrays(server.post("/v1/" + FLOW, CLOUD).body)
            job = submit(server, FLOW)
            eventually(lambda: stepped(server, job) > 20, what="under way")
            began = time.monotonic()
            server.signal()
            assert server.wait(7) == 0 and time.monotonic() - began < 3 * harness.SLOW, "parked at once"
            assert "parked" in server.log()
        with Server(jobs_dir=path) as server:
            record = finished(server, job, 60)
            assert record["state"] == "succeeded", record
            assert server.metric("gnpd_jobs_resumed_total") == 1
            assert flow_arrays(server.get(record["result"]["href"]).body) == wanted


def test_a_killed_flow_goes_on_from_its_checkpoint():
    with folder() as path:
        server = Server(jobs_dir=path, jobs_checkpoint_seconds=0)
        wanted = flow_arrays(server.post("/v1/" + FLOW, CLOUD).body)
        job = submit(server, FLOW)
        eventually(lambda: server.metric("gnpd_jobs_checkpoints_total") >= 2, what="checkpoints")
        kill(server)
        with Server(jobs_dir=path) as server:
            record = finished(server, job, 60)
            assert record["state"] == "succeeded" and server.metric("gnpd_jobs_resumed_total") == 1, record
            assert flow_arrays(server.get(record["result"]["href"]).body) == wanted
            server.wait_metric("gnpd_jobs_bytes", record["result"]["bytes"])


def test_a_job_the_daemon_does_not_survive_is_given_up():
    with folder() as path:
        job = None
        for attempt in range(2):
            server = Server(jobs_dir=path)
            job = job or submit(server, LONG)
            running(server, job)
            kill(server)
        with Server(jobs_dir=path) as server:
            record = server.get("/v1/jobs/" + job).json
            assert record["state"] == "failed" and DIED_TWICE in record["error"]["text"], record
            assert server.post("/v1/" + QUICK, CLOUD).status == 200
        with Server(jobs_dir=path) as server:
            assert server.get("/v1/jobs/" + job).json == record


def test_a_job_whose_result_was_lost_does_not_say_it_is_whole():
    """It had failed, and its progress was that of a job that succeeded."""
    with folder() as path:
        server = Server(jobs_dir=path)
        job = finished(server, submit(server))["id"]
        kill(server)
        os.unlink(os.path.join(path, job + ".result"))
        for start in range(2):
            with Server(jobs_dir=path) as server:
                record = server.get("/v1/jobs/" + job).json
                assert record["state"] == "failed" and record["error"]["code"] == "storage" and record["progress"]["fraction"] == 0, record


def test_parking_is_no_attempt():
    with folder() as path:
        job = None
        for restart in range(3):
            with Server(jobs_dir=path, jobs_attempts=1) as server:
                job = job or submit(server, LONG)
                running(server, job)
        with Server(jobs_dir=path, jobs_attempts=1) as server:
            running(server, job)
            delete(server, job)


def test_waiting_clients_do_not_hold_the_end_up():
    with Server(drain_seconds=20) as server:
        job = submit(server, LONG)
        running(server, job)
        with server.connect() as poll, server.connect() as stream:
            poll.sendall(harness.make_request("GET", "/v1/jobs/%s?wait=60s" % job))
            stream.sendall(harness.make_request("GET", "/v1/jobs/%s/events" % job))
            server.wait_metric("gnpd_jobs_watches", 2)
            began = time.monotonic()
            server.signal()
            assert harness.read_response(poll).status == 200
            assert server.wait(5) == 0 and time.monotonic() - began < 4 * harness.SLOW


def test_kill_audit():
    with folder() as path:
        report = audit.run(path, kills=5, seconds=0.5, seed=20261125)
        assert report["kills"] == 5 and report["acknowledged"] >= 5, report
        assert not report["lost"] and not report["wrong"], report
