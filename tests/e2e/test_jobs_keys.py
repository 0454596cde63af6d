"""Jobs and keys together: whose a job is, who may submit one, and that this outlives the daemon."""
import os
import subprocess

import credentials
import harness
from credentials import bearer, line, new_key
from harness import expect_error
from test_jobs import CLOUD, QUICK, finished, folder

ALICE, BOB, READER = new_key(), new_key(), new_key()


def put_keys(secrets):
    return secrets.put("keys", line("alice", ALICE, "jobs", "concurrency=4") + line("bob", BOB, "infer,jobs") + line("reader", READER, "infer"))


def submit(server, key, headers=None):
    response = server.post("/v1/jobs/" + QUICK, CLOUD, dict(headers or {}, **bearer(key)))
    assert response.status == 202, response.text
    return response.json["id"]


def ids_of(server, key):
    return [job["id"] for job in server.get("/v1/jobs", headers=bearer(key)).json["jobs"]]


def ended(server, key, job):
    return server.get("/v1/jobs/%s?wait=20s" % job, headers=bearer(key)).json["state"]


def expect_hidden(server, job):
    """In every verb somebody else's job answers like one that does not exist."""
    nowhere = "0123456789abcdef0123456789abcd"
    for method, path in (("GET", "/v1/jobs/%s"), ("GET", "/v1/jobs/%s/result"), ("GET", "/v1/jobs/%s/events"), ("DELETE", "/v1/jobs/%s")):
        answers = [server.request(method, path % name, headers=bearer(BOB)) for name in (job, nowhere)]
        for answer in answers:
            expect_error(answer, 404, "not_found")
        assert answers[0].json["error"].replace(job, "") == answers[1].json["error"].replace(nowhere, "")


def test_jobs_are_seen_by_their_key_only():
    with credentials.Folder() as secrets, folder() as jobs_dir:
        keys = put_keys(secrets)
        with harness.Server(keys_file=keys, jobs_dir=jobs_dir) as server:
            job = submit(server, ALICE, {"Idempotency-Key": "same"})
            assert ended(server, ALICE, job) == "succeeded"
            expect_hidden(server, job)
            assert ids_of(server, BOB) == [] and ids_of(server, ALICE) == [job]
            other = submit(server, BOB, {"Idempotency-Key": "same"})  # a key of its own
            assert other != job and ended(server, BOB, other) == "succeeded"
        with harness.Server(keys_file=keys, jobs_dir=jobs_dir) as server:
            assert ids_of(server, ALICE) == [job] and ids_of(server, BOB) == [other]
            expect_hidden(server, job)
            again = server.post("/v1/jobs/" + QUICK, CLOUD, dict({"Idempotency-Key": "same"}, **bearer(ALICE)))
            assert again.json["id"] == job
            assert server.request("DELETE", "/v1/jobs/" + job, headers=bearer(ALICE)).status == 204
            assert ids_of(server, ALICE) == []


def test_jobs_need_their_scope():
    with credentials.Folder() as secrets, harness.Server(keys_file=put_keys(secrets)) as server:
        expect_error(server.post("/v1/jobs/" + QUICK, CLOUD), 401, "unauthorized")
        for method, path in (("POST", "/v1/jobs/estimate"), ("GET", "/v1/jobs"), ("GET", "/v1/jobs/x"), ("DELETE", "/v1/jobs/x")):
            expect_error(server.request(method, path, CLOUD if method == "POST" else None, bearer(READER)), 403, "forbidden", "jobs")
        expect_error(server.post("/v1/estimate?estimator=gmls", CLOUD, bearer(ALICE)), 403, "forbidden", "infer")


def test_the_command_line_shows_its_key():
    gnp = os.environ.get("GNP", os.path.join(os.path.dirname(harness.BINARY), "gnp"))
    with credentials.Folder() as secrets, harness.Server(keys_file=put_keys(secrets)) as server:
        url = "http://127.0.0.1:%d" % server.port
        cloud, answer = secrets.name("cloud.ply"), secrets.name("answer.ply")
        with open(cloud, "wb") as file:
            file.write(CLOUD)
        with_key = dict(os.environ, GNP_KEY=ALICE)
        subprocess.run([gnp, "estimate", cloud, "--estimator", "gmls", "--url", url, "--job", "--wait", "-o", answer], check=True, env=with_key)
        assert os.path.getsize(answer) > 1000
        listed = subprocess.run([gnp, "jobs", "--url", url, "--key", ALICE], check=True, capture_output=True, text=True).stdout
        assert "succeeded" in listed and ids_of(server, ALICE)[0] in listed
        assert subprocess.run([gnp, "jobs", "--url", url, "--key", BOB], check=True, capture_output=True, text=True).stdout == ""
        refused = subprocess.run([gnp, "jobs", "--url", url], capture_output=True, text=True, env={k: v for k, v in os.environ.items() if k != "GNP_KEY"})
        assert refused.returncode == 3 and "a key is needed" in refused.stderr, (refused.returncode, refused.stderr)
