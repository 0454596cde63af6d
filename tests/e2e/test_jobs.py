"""Jobs: every verb, what is refused, long polls and events, results in parts, idempotency, quotas, time to live, faults of the disk."""
import contextlib
import gzip
import json
import os
import re
import resource
import shutil
import subprocess
import tempfile
import threading
import time

import harness
from harness import Server, eventually, expect_error

CLOUD = harness.ply(harness.sphere(600))
QUICK = "estimate?estimator=gmls"
LONG = "flow?estimator=gmls&steps=1000000&dt=1e-9&scheme=explicit"  # hours
UNKNOWN = "0123456789abcdef0123456789abcd"
FINAL = ("succeeded", "failed", "cancelled", "expired")


@contextlib.contextmanager
def folder():
    path = tempfile.mkdtemp(prefix="gnpd-jobs-test.")
    try:
        yield path
    finally:
        shutil.rmtree(path, ignore_errors=True)


def submit(server, call=QUICK, body=CLOUD, headers=None):
    response = server.post("/v1/jobs/" + call, body, headers)
    assert response.status == 202, (response.status, response.text)
    return response.json["id"]


def finished(server, job, seconds=20):
    until = time.monotonic() + seconds * harness.SLOW
    while True:
        record = server.get("/v1/jobs/%s?wait=5s" % job).json
        if record["state"] in FINAL:
            return record
        assert time.monotonic() < until, record


def running(server, job):
    eventually(lambda: server.get("/v1/jobs/" + job).json["state"] == "running", what="running")


def delete(server, job):
    return server.request("DELETE", "/v1/jobs/" + job)


def without_seconds(data):
    """The answer but for its timings: lines of comments, and the last column of a flow's record."""
    return re.sub(rb"comment seconds_\w+ [^\n]*\n", b"", data)


# ---- the way of a job ----

def test_job_answers_what_the_call_would(server):
    wanted = server.post("/v1/" + QUICK, CLOUD)
    response = server.post("/v1/jobs/" + QUICK, CLOUD)
    record = response.json
    assert response.status == 202 and response.headers["location"] == "/v1/jobs/" + record["id"], response.headers
    assert int(response.headers["retry-after"]) >= 1 and record["operation"] == "estimate" and record["state"] in ("queued", "running")
    assert re.fullmatch(r"\d{4}-\d\d-\d\dT\d\d:\d\d:\d\d\.\d{6}Z", record["created"]), record
    record = finished(server, record["id"])
    assert record["state"] == "succeeded" and record["progress"]["fraction"] == 1, record
    assert record["created"] <= record["started"] <= record["finished"]
    result = server.get(record["result"]["href"])
    assert result.status == 200 and result.headers["content-type"] == wanted.headers["content-type"] == "application/ply"
    assert "estimate;dur=" in result.headers["server-timing"] and len(result.body) == record["result"]["bytes"]
    assert without_seconds(result.body) == without_seconds(wanted.body)


def test_job_takes_accept_and_content_encoding(server):
    import gzip
    headers = {"Accept": "application/json", "Content-Encoding": "gzip"}
    record = finished(server, submit(server, QUICK, gzip.compress(CLOUD), headers))
    result = server.get(record["result"]["href"])
    assert result.headers["content-type"] == "application/json" and len(result.json["normals"]) == 600, result.text[:200]


def test_results_of_jobs_have_the_type_the_call_has(server):
    """The call answered model/ply where that was asked for, and the result of the job application/ply."""
    for accept in ("model/ply", "Model/PLY;q=0.5", "application/octet-stream", "application/json", "text/csv", "application/npz", "*/*"):
        wanted = server.post("/v1/" + QUICK, CLOUD, {"Accept": accept}).headers["content-type"]
        record = finished(server, submit(server, QUICK, CLOUD, {"Accept": accept}))
        got = server.get(record["result"]["href"]).headers["content-type"]
        assert got == record["result"]["content_type"] == wanted, (accept, got, record, wanted)


def test_job_takes_the_inference_protocol(server):
    headers, body = harness.points_body(harness.sphere(600), estimator="gmls")
    record = finished(server, submit(server, "estimate", body, headers))
    result = server.get(record["result"]["href"])
    head, arrays = harness.parse_infer(result)
    assert head["model_name"] == "estimate" and len(arrays["mean_curvature"]) == 600
    message = {"id": "mine", "parameters": {"estimator": "gmls"}, "outputs": [{"name": "mean_curvature"}],
               "inputs": [{"name": "points", "shape": [600, 3], "datatype": "FP32", "data": list(harness.sphere(600))}]}
    record = finished(server, submit(server, "estimate", json.dumps(message).encode(), {"Content-Type": "application/json"}))
    answer = server.get(record["result"]["href"]).json
    assert answer["id"] == "mine" and answer["outputs"][0]["name"] == "mean_curvature", answer
    points = {"points": [list(harness.sphere(600)[i:i + 3]) for i in range(0, 1800, 3)]}  # a cloud in JSON is a file
    record = finished(server, submit(server, QUICK, json.dumps(points).encode(), {"Content-Type": "application/json"}))
    assert "normals" in server.get(record["result"]["href"]).json


def test_job_is_checked_before_it_is_taken(server):
    before = server.metric("gnpd_jobs_submitted_total")
    expect_error(server.post("/v1/jobs/nothing", CLOUD), 404, "not_found", "nothing", "known: estimate")
    expect_error(server.post("/v1/jobs/estimate?colour=red", CLOUD), 400, "invalid_argument", "colour", "known:")
    expect_error(server.post("/v1/jobs/estimate?k=3", CLOUD), 400, "invalid_argument", "k: got 3, need 12..500")
    expect_error(server.post("/v1/jobs/estimate", b""), 400, "invalid_argument", "body: got 0 bytes")
    expect_error(server.post("/v1/jobs/estimate", b"ply\nnonsense"), 400, "invalid_argument")
    expect_error(server.post("/v1/jobs/estimate", CLOUD[:-5]), 400, "invalid_argument")
    expect_error(server.post("/v1/jobs/estimate", CLOUD, {"Accept": "text/html"}), 406, "not_acceptable")
    expect_error(server.post("/v1/jobs/estimate?timeout=soon", CLOUD), 400, "invalid_argument", "timeout: got \"soon\"")
    expect_error(server.post("/v1/jobs/estimate", CLOUD, {"Idempotency-Key": "x" * 129}), 400, "invalid_argument", "129", "1..128")
    expect_error(server.post("/v1/jobs/estimate", b"{}", {"Inference-Header-Content-Length": "5"}), 400, "invalid_argument")
    assert server.metric("gnpd_jobs_submitted_total") == before


def test_unknown_jobs_are_not_found(server):
    for job in (UNKNOWN, "x", "..", "lock"):
        for method, path in (("GET", ""), ("GET", "/result"), ("GET", "/events"), ("DELETE", ""), ("GET", "?wait=1s")):
            expect_error(server.request(method, "/v1/jobs/" + job + path), 404, "not_found", "job: there is no")
        for method, path in (("GET", "/result"), ("GET", "/events"), ("DELETE", "")):
            expect_error(server.request(method, "/v1/jobs/%s%s?colour=red" % (job, path)), 400, "invalid_argument", "colour", "known: none")
    response = server.request("PUT", "/v1/jobs/" + UNKNOWN)
    expect_error(response, 405, "method_not_allowed")
    assert set(response.headers["allow"].split(", ")) >= {"GET", "HEAD", "DELETE"}, response.headers["allow"]
    expect_error(server.get("/v1/jobs/%s?colour=red" % UNKNOWN), 400, "invalid_argument", "colour", "known: wait")


def test_a_failed_job_says_why(server):
    flat = harness.ply(harness.floats([0.0, 0.0, 0.0] * 50))
    wanted = server.post("/v1/" + QUICK, flat)
    record = finished(server, submit(server, QUICK, flat))
    assert record["state"] == "failed" and record["error"]["code"] == "degenerate_geometry", record
    assert record["error"]["text"] == wanted.json["error"]
    expect_error(server.get("/v1/jobs/%s/result" % record["id"]), wanted.status, "degenerate_geometry", wanted.json["error"])


# ---- results ----

def test_results_come_in_parts(server):
    record = finished(server, submit(server))
    path = record["result"]["href"]
    whole = server.get(path)
    tag, size = whole.headers["etag"], len(whole.body)
    assert whole.headers["accept-ranges"] == "bytes"
    head = server.request("HEAD", path)
    assert head.status == 200 and head.body == b"" and int(head.headers["content-length"]) == size
    for text, first, last in (("0-9", 0, 9), ("%d-" % (size - 3), size - 3, size - 1), ("-7", size - 7, size - 1), ("5-999999999", 5, size - 1)):
        part = server.get(path, headers={"Range": "bytes=" + text})
        assert part.status == 206 and part.body == whole.body[first:last + 1], text
        assert part.headers["content-range"] == "bytes %d-%d/%d" % (first, last, size)
    outside = server.get(path, headers={"Range": "bytes=%d-" % size})
    expect_error(outside, 416, "range_not_satisfiable", str(size))
    assert outside.headers["content-range"] == "bytes */%d" % size
    for ignored in ("bytes=0-1,3-4", "rows=0-1", "bytes=9-3"):
        assert server.get(path, headers={"Range": ignored}).status == 200
    assert server.get(path, headers={"Range": "bytes=0-1", "If-Range": tag}).status == 206
    assert server.get(path, headers={"Range": "bytes=0-1", "If-Range": '"other"'}).body == whole.body
    same = server.get(path, headers={"If-None-Match": tag})
    assert same.status == 304 and same.body == b"" and same.headers["etag"] == tag


def test_a_large_result_is_taken_slowly(server):
    record = finished(server, submit(server, QUICK + "&quantities=all", harness.ply(harness.sphere(9000))))
    size = record["result"]["bytes"]
    with server.connect() as s:
        s.sendall(harness.make_request("GET", record["result"]["href"]))
        time.sleep(0.1)
        response = harness.read_response(s)
    assert size > 2e6 and len(response.body) == size, size


# ---- waiting ----

def test_long_polls_end_with_the_job():
    with Server(runners=1, http_threads=1, job_runners=1, jobs_wait_seconds=1) as server:
        first, second = submit(server, LONG), submit(server)
        began = time.monotonic()
        record = server.get("/v1/jobs/%s?wait=30s" % second).json
        assert record["state"] == "queued" and 0.9 < time.monotonic() - began < 5 * harness.SLOW, "bounded by jobs-wait-seconds"
        answers = []
        waiters = [threading.Thread(target=lambda: answers.append(server.get("/v1/jobs/%s?wait=1s" % second).json)) for _ in range(20)]
        for waiter in waiters:
            waiter.start()
        server.wait_metric("gnpd_jobs_watches", 20)
        assert server.get("/v2/health/live").status == 200 and server.post("/v1/" + QUICK, CLOUD).status == 200
        assert delete(server, first).status == 202
        for waiter in waiters:
            waiter.join()
        assert len(answers) == 20 and server.metric("gnpd_jobs_watches") == 0
        assert finished(server, second)["state"] == "succeeded"
        expect_error(server.get("/v1/jobs/%s?wait=-3s" % second), 400, "invalid_argument", "wait: got \"-3s\"")


def test_a_waiting_client_that_leaves_is_noticed():
    with Server(jobs_watch_count=2) as server:
        job = submit(server, LONG)
        running(server, job)
        poll, stream = server.connect(), server.connect()
        poll.sendall(harness.make_request("GET", "/v1/jobs/%s?wait=60s" % job))
        stream.sendall(harness.make_request("GET", "/v1/jobs/%s/events" % job))
        server.wait_metric("gnpd_jobs_watches", 2)
        expect_error(server.get("/v1/jobs/%s?wait=1s" % job), 503, "overloaded", "jobs-watch-count")
        assert server.get("/v1/jobs/" + job).status == 200
        poll.close()
        stream.close()
        server.wait_metric("gnpd_jobs_watches", 0)
        assert server.get("/v1/jobs/" + job).json["state"] == "running", "a job has no client that could leave it"
        assert delete(server, job).status == 202


def read_events(s, until, seconds=10):
    data, end = b"", time.monotonic() + seconds * harness.SLOW
    while not until(data):
        assert time.monotonic() < end, data[-1000:]
        part = s.recv(65536)
        if not part:
            break
        data += part
    return data


def test_events_tell_the_way_and_the_end():
    with Server(jobs_heartbeat_seconds=0.3, job_runners=1) as server:
        job, waiting = submit(server, LONG), submit(server)
        running(server, job)
        with server.connect() as s, server.connect() as idle:
            s.sendall(harness.make_request("GET", "/v1/jobs/%s/events" % job, headers={"Last-Event-ID": "77"}))
            idle.sendall(harness.make_request("GET", "/v1/jobs/%s/events" % waiting))
            read_events(s, lambda data: b"event: progress" in data)
            assert b": heartbeat" in read_events(idle, lambda data: b": heartbeat" in data)
            assert delete(server, job).status == 202
            end = read_events(s, lambda data: b"\r\n0\r\n\r\n" in data)
            states = re.findall(rb'"state":"(\w+)"', end)
            assert states[-1] == b"cancelled", end
            rest = read_events(idle, lambda data: b"\r\n0\r\n\r\n" in data)
            assert b'"state":"succeeded"' in rest and b"event: state" in rest, rest
        with server.connect() as s:  # of one that is over: its state and the end
            s.sendall(harness.make_request("GET", "/v1/jobs/%s/events" % waiting))
            data = read_events(s, lambda data: b"\r\n0\r\n\r\n" in data)
            assert b"text/event-stream" in data and data.count(b"event: ") == 1, data
        server.wait_metric("gnpd_jobs_watches", 0)


def test_progress_grows(server):
    job = submit(server, "flow?estimator=gmls&steps=60")
    seen = []
    while True:
        record = server.get("/v1/jobs/" + job).json
        seen.append(record["progress"]["fraction"])
        if record["state"] in FINAL:
            break
        progress = record["progress"]
        if progress["stage"] == "flow":
            assert progress["steps"] == 60 and 0 <= progress["step"] <= 60, progress
        time.sleep(0.01)
    assert seen == sorted(seen) and seen[-1] == 1 and len(set(seen)) > 3, seen


# ---- deleting ----

def test_jobs_are_cancelled_and_removed():
    with Server(job_runners=1) as server:
        first, second = submit(server, LONG), submit(server)
        running(server, first)
        expect_error(server.get("/v1/jobs/%s/result" % first), 409, "conflict", "running", "wait=")
        answer = delete(server, second)
        assert answer.status == 200 and answer.json["state"] == "cancelled", answer.text
        began = time.monotonic()
        assert delete(server, first).status == 202
        assert finished(server, first)["state"] == "cancelled" and time.monotonic() - began < 2 * harness.SLOW
        for job in (first, second):
            expect_error(server.get("/v1/jobs/%s/result" % job), 410, "gone", "cancelled")
            assert delete(server, job).status == 204
            expect_error(delete(server, job), 404, "not_found")
        assert server.metric("gnpd_jobs_bytes") == 0 and server.get("/v1/jobs").json == {"jobs": [], "more": False, "next": None}


def test_jobs_are_listed_newest_first():
    with Server(job_runners=1) as server:
        ids = [submit(server) for _ in range(3)] + [submit(server, "filter?estimator=adaptive")]
        for job in ids:
            finished(server, job)
        ids.append(submit(server, LONG))
        listed = lambda query: [record["id"] for record in server.get("/v1/jobs" + query).json["jobs"]]
        assert listed("") == ids[::-1]
        assert listed("?operation=estimate") == ids[2::-1] and listed("?state=succeeded") == ids[3::-1]
        assert listed("?operation=estimate&state=failed") == [] and listed("?after=" + ids[2]) == ids[1::-1]
        page = server.get("/v1/jobs?limit=2").json
        assert page["more"] is True and page["next"] == "/v1/jobs?limit=2&after=" + ids[3]
        path, pages = "/v1/jobs?limit=1&state=succeeded&operation=estimate", []
        while path:  # the next page asks for what the first did
            page = server.get(path).json
            pages.append([record["id"] for record in page["jobs"]])
            path = page["next"]
        assert pages == [[job] for job in ids[2::-1]], pages
        assert server.get("/v1/jobs?limit=5").json["more"] is False
        delete(server, ids[2])
        assert listed("?after=" + ids[2]) == ids[1::-1], "a place in the list outlives its job"
        for query, text in (("limit=0", "limit: got"), ("limit=x", "limit: got"), ("state=done", "known: queued"),
                            ("operation=x", "operation:"), ("after=zz", "after: got"), ("colour=red", "known: state")):
            expect_error(server.get("/v1/jobs?" + query), 400, "invalid_argument", text)
        delete(server, ids[4])


# ---- asking twice ----

def test_the_same_key_is_the_same_job():
    with folder() as path:
        key = {"Idempotency-Key": "nightly run, 7"}
        with Server(jobs_dir=path) as server:
            job = submit(server, QUICK, CLOUD, key)
            again = server.post("/v1/jobs/" + QUICK, CLOUD, key)
            assert again.status == 200 and again.json["id"] == job and again.headers["location"] == "/v1/jobs/" + job
            others = (("estimate?estimator=gmls&k=40", CLOUD, {}), (QUICK, CLOUD + b" ", {}), (QUICK, CLOUD, {"Accept": "application/json"}),
                      ("filter?estimator=gmls", CLOUD, {}))
            for call, body, headers in others:
                response = server.post("/v1/jobs/" + call, body, dict(headers, **key))
                if response.status != 400:  # a trailing byte may be refused before
                    expect_error(response, 409, "conflict", "Idempotency-Key", job)
            assert submit(server, QUICK, CLOUD, {"Idempotency-Key": "another"}) != job
            finished(server, job)
        with Server(jobs_dir=path) as server:
            again = server.post("/v1/jobs/" + QUICK, CLOUD, key)
            assert again.status == 200 and again.json["id"] == job and again.json["state"] == "succeeded"
            assert server.metric("gnpd_jobs_replayed_total") == 1
            assert delete(server, job).status == 204
            assert submit(server, QUICK, CLOUD, key) != job, "a job that is gone has no key"


def test_one_of_many_with_a_key_makes_the_job(server):
    answers = []
    ask = lambda: answers.append(server.post("/v1/jobs/" + QUICK, CLOUD, {"Idempotency-Key": "race"}))
    threads = [threading.Thread(target=ask) for _ in range(12)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    taken = [answer for answer in answers if answer.status in (200, 202)]
    assert sum(answer.status == 202 for answer in answers) == 1, [answer.status for answer in answers]
    assert len({answer.json["id"] for answer in taken}) == 1
    for answer in answers:
        if answer not in taken:
            expect_error(answer, 409, "in_progress", "is being taken")
            assert int(answer.headers["retry-after"]) >= 1


# ---- limits ----

def test_a_full_store_refuses_and_can_be_emptied():
    with Server(job_runners=1, jobs_count=3, jobs_queue_count=1) as server:
        first = submit(server, LONG)
        running(server, first)
        second = submit(server)
        expect_error(server.post("/v1/jobs/" + QUICK, CLOUD), 503, "overloaded", "jobs: 1 wait, at most 1 may (jobs-queue-count)")
        delete(server, first)
        finished(server, second)
        third = submit(server)
        finished(server, third)
        expect_error(server.post("/v1/jobs/" + QUICK, CLOUD), 507, "no_space", "jobs: 3 are kept, at most 3 may be (jobs-count)")
        assert server.metric('gnpd_jobs_refused_total{reason="count"}') == 1 and server.metric('gnpd_jobs_refused_total{reason="queue"}') == 1
        assert server.post("/v1/" + QUICK, CLOUD).status == 200
        assert server.get("/v1/jobs/" + second).json["state"] == "succeeded", "those that are over stay"
        assert delete(server, second).status == 204
        finished(server, submit(server))


def test_bytes_are_bounded():
    with Server(jobs_bytes=len(CLOUD) + 14000) as server:
        expect_error(server.post("/v1/jobs/" + QUICK, harness.ply(harness.sphere(2000))), 507, "no_space", "jobs-bytes")
        record = finished(server, submit(server))  # the result does not fit
        assert record["state"] == "failed" and record["error"]["code"] == "no_space" and "jobs-bytes" in record["error"]["text"], record
        server.wait_metric("gnpd_jobs_bytes", 0)
        record = finished(server, submit(server, QUICK + "&quantities=mean_curvature"))
        server.wait_metric("gnpd_jobs_bytes", record["result"]["bytes"])


def test_jobs_that_are_over_expire_and_are_forgotten():
    with folder() as path, Server(jobs_dir=path, jobs_ttl_seconds=0.8 * harness.SLOW) as server:
        job = finished(server, submit(server, QUICK, CLOUD, {"Idempotency-Key": "k"}))["id"]
        eventually(lambda: server.get("/v1/jobs/" + job).json["state"] == "expired", what="expired")
        expect_error(server.get("/v1/jobs/%s/result" % job), 410, "gone", "jobs-ttl-seconds")
        assert server.metric("gnpd_jobs_bytes") == 0 and not [name for name in os.listdir(path) if name.endswith(".result")]
        eventually(lambda: server.get("/v1/jobs/" + job).status == 404, what="forgotten")
        assert os.listdir(path) == ["lock"]
    with Server(jobs_count=1, jobs_ttl_seconds=0.5 * harness.SLOW) as server:  # what expired makes room
        job = submit(server)
        eventually(lambda: server.get("/v1/jobs/" + job).json["state"] == "expired", what="expired")
        assert submit(server) != job
        expect_error(server.get("/v1/jobs/" + job), 404, "not_found")


def test_jobs_have_time_limits():
    with Server(jobs_seconds=0.4, work_seconds=100) as server:
        record = finished(server, submit(server, LONG))
        assert record["state"] == "failed" and record["error"]["code"] == "deadline_exceeded", record
        assert record["error"]["text"].endswith("need it in 0.4 s (jobs-seconds)"), record
        assert server.metric('gnpd_cancelled_total{reason="deadline"}') == 1
        progress = record["progress"]
        assert progress["stage"] == "flow" and progress["step"] > 0 and progress["fraction"] >= 0.1 and progress["eta_seconds"] is None, progress
    with Server() as server:
        record = finished(server, submit(server, LONG + "&timeout=300ms"))
        assert record["error"]["code"] == "deadline_exceeded" and record["error"]["text"].endswith("need it in 0.3 s (timeout)"), record
        headers, body = harness.points_body(harness.sphere(600), estimator="gmls", steps=1000000, dt=1e-9, scheme="explicit", timeout=300000)
        record = finished(server, submit(server, "flow", body, headers))
        assert record["error"]["code"] == "deadline_exceeded", record


def test_requests_have_timeouts_of_their_own():
    with Server(runners=1, work_seconds=1.5 * harness.SLOW) as server:
        began = time.monotonic()
        expect_error(server.post("/v1/" + LONG + "&timeout=300ms", CLOUD), 504, "deadline_exceeded")
        headers, body = harness.points_body(harness.sphere(600), estimator="gmls", steps=1000000, dt=1e-9, scheme="explicit", timeout=300000)
        expect_error(server.post("/v2/models/flow/infer", body, headers), 504, "deadline_exceeded")
        assert time.monotonic() - began < 1.4 * harness.SLOW
        began = time.monotonic()  # no more than work-seconds, though more is asked for
        expect_error(server.post("/v1/" + LONG + "&timeout=1h", CLOUD), 504, "deadline_exceeded")
        assert 1.4 * harness.SLOW < time.monotonic() - began < 8 * harness.SLOW
        assert server.post("/v1/" + QUICK + "&timeout=0", CLOUD).status == 200  # 0: none
        for bad in ("soon", "-1s", "1e300"):
            expect_error(server.post("/v1/%s&timeout=%s" % (QUICK, bad), CLOUD), 400, "invalid_argument", "timeout: got")
        headers, body = harness.points_body(harness.sphere(600), estimator="gmls", timeout=-5)
        expect_error(server.post("/v2/models/estimate/infer", body, headers), 400, "invalid_argument", "timeout")


def test_requests_do_not_wait_behind_jobs():
    with Server(runners=1, job_runners=2) as server:
        jobs = [submit(server, LONG) for _ in range(4)]
        running(server, jobs[1])
        began = time.monotonic()
        for _ in range(5):
            assert server.post("/v1/" + QUICK, CLOUD).status == 200
        assert time.monotonic() - began < 3 * harness.SLOW
        assert [server.get("/v1/jobs/" + job).json["state"] for job in jobs] == ["running", "running", "queued", "queued"]
        for job in jobs:
            delete(server, job)


def test_jobs_wait_for_memory_instead_of_failing():
    with Server(queue_bytes="64M", job_runners=3) as server:
        body = harness.ply(harness.sphere(8000))
        jobs = [submit(server, "flow?estimator=gmls&steps=3", body) for _ in range(4)]
        assert [finished(server, job, 60)["state"] for job in jobs] == ["succeeded"] * 4
        server.wait_metric("gnpd_queue_bytes", 0)
        server.wait_metric("gnpd_jobs_memory_bytes", 0)
        expect_error(server.post("/v1/jobs/flow?steps=1000000&snapshot_every=1000", body), 413, "too_large", "jobs-memory-bytes")
        assert server.metric('gnpd_jobs_refused_total{reason="memory"}') == 1


def test_what_a_body_decodes_to_is_of_the_jobs_share():
    with Server() as server:
        job = submit(server, LONG, gzip.compress(harness.ply(harness.sphere(8000))), {"Content-Encoding": "gzip"})
        eventually(lambda: server.get("/v1/jobs/" + job).json["progress"]["step"] > 0, what="its first step")
        held = server.metric("gnpd_jobs_memory_bytes")
        assert held == server.metric("gnpd_queue_bytes") and held > 200_000, held
        delete(server, job)
        server.wait_metric("gnpd_queue_bytes", 0)
        server.wait_metric("gnpd_jobs_memory_bytes", 0)


# ---- the disk ----

def test_a_disk_without_room_is_told():
    with folder() as path, Server(jobs_dir=path) as server:
        kept = finished(server, submit(server))
        for size in (0, 100, len(CLOUD) - 1):
            resource.prlimit(server.process.pid, resource.RLIMIT_FSIZE, (size, resource.RLIM_INFINITY))
            expect_error(server.post("/v1/jobs/" + QUICK, CLOUD), 507, "no_space", "cannot write", "jobs-dir")
            eventually(lambda: len(os.listdir(path)) == 3, what="lock, a record and a result only")
        resource.prlimit(server.process.pid, resource.RLIMIT_FSIZE, (len(CLOUD) + 100, resource.RLIM_INFINITY))
        record = finished(server, submit(server))  # body and record fit, the result does not
        assert record["state"] == "failed" and record["error"]["code"] == "no_space", record
        job = submit(server, LONG)
        running(server, job)
        resource.prlimit(server.process.pid, resource.RLIMIT_FSIZE, (0, resource.RLIM_INFINITY))
        assert delete(server, job).status == 202 and finished(server, job)["state"] == "cancelled"
        for gone in (job, record["id"], kept["id"]):
            assert delete(server, gone).status == 204
        server.wait_metric("gnpd_jobs_bytes", 0)
        assert os.listdir(path) == ["lock"]
        resource.prlimit(server.process.pid, resource.RLIMIT_FSIZE, (resource.RLIM_INFINITY, resource.RLIM_INFINITY))
        assert finished(server, submit(server))["state"] == "succeeded"


def start(path, **flags):
    """The exit status and the text of a daemon that is not to start."""
    command = [harness.BINARY, "--listen", "127.0.0.1:0", "--jobs-dir", path]
    done = subprocess.run(command, stderr=subprocess.PIPE, timeout=20 * harness.SLOW, cwd=tempfile.gettempdir())
    return done.returncode, done.stderr.decode()


def test_a_folder_that_will_not_do_is_refused_at_the_start():
    with folder() as path:
        for bad, text in ((path + "/missing", "No such file"), ("/proc/self/status", "Not a directory"), ("/proc/self", "jobs-dir: /proc/self")):
            code, said = start(bad)
            assert code == 1 and "jobs-dir: " in said and text in said, said
        with Server(jobs_dir=path):
            code, said = start(path)
            assert code == 1 and "another gnpd uses it" in said and path in said, said
        with Server(jobs_dir=path):
            pass  # the lock goes with its process


def test_damaged_records_do_not_stop_the_start():
    with folder() as path:
        with Server(jobs_dir=path) as server:
            good, bad = submit(server), submit(server)
            finished(server, good), finished(server, bad)
        name = os.path.join(path, bad + ".job")
        with open(name, "r+b") as file:
            file.seek(100)
            file.write(b"\0")
        for junk in (UNKNOWN + ".job", UNKNOWN + ".body.new"):
            with open(os.path.join(path, junk), "wb") as file:
                file.write(os.urandom(1000))
        with Server(jobs_dir=path) as server:
            assert server.get("/v1/jobs/" + good).json["state"] == "succeeded" and server.get("/v1/jobs/" + bad).status == 404
            assert server.metric("gnpd_jobs_damaged_total") == 2
            assert "set aside" in server.log() and os.path.exists(name + ".damaged") and not os.path.exists(name)


def test_without_a_folder_jobs_end_with_the_process():
    with folder() as temporary:
        old = os.environ.get("TMPDIR")
        os.environ["TMPDIR"] = temporary
        try:
            server = Server()
            with server:
                finished(server, submit(server))
                submit(server, LONG)
                names = [name for name in os.listdir(temporary) if name.startswith("gnpd-jobs.")]
                assert len(names) == 1
            assert not [name for name in os.listdir(temporary) if name.startswith("gnpd-jobs.")]
        finally:
            os.environ.pop("TMPDIR")
            if old is not None:
                os.environ["TMPDIR"] = old
