"""Keys: who may do what, limits of a key, keys that change while the daemon runs, and files that are no good."""
import gzip
import json
import signal
import subprocess
import threading
import time

import credentials
import harness
from credentials import bearer, line, new_key
from harness import SLOW, expect_error

ESTIMATE = "/v2/models/estimate/infer"
SMALL = harness.sphere(600)
REJECTED = "gnpd_rejected_total{reason=\"%s\"}"


class Kit:
    """A daemon with three keys; its metrics are read with the third."""

    def __init__(self, limits="", **flags):
        self.work, self.jobs, self.admin = new_key(), new_key(), new_key()
        self.folder = credentials.Folder()
        self.folder.__enter__()
        self.path = self.folder.put("keys", "# names, hashes, scopes\n\n" + line("worker", self.work, "infer", limits) +
                                    line("batch", self.jobs, "jobs") + line("boss", self.admin, "admin,infer"))
        self.server = harness.Server(keys_file=self.path, **flags)

    def __enter__(self):
        return self

    def __exit__(self, *fault):
        self.server.__exit__(*fault)
        self.folder.__exit__()

    def metric(self, name):
        for text in self.server.get("/metrics", headers=bearer(self.admin)).text.splitlines():
            if text.startswith(name + " "):
                return float(text.rsplit(" ", 1)[1])
        raise AssertionError("no metric " + name)

    def estimate(self, headers, **arguments):
        more, body = harness.points_body(SMALL)
        return self.server.post(ESTIMATE, body, dict(more, **headers), **arguments)


def expect_unauthorized(response, *texts):
    expect_error(response, 401, "unauthorized", *texts)
    assert response.headers["www-authenticate"] == "Bearer", response.headers


def test_who_may_do_what():
    with Kit() as kit:
        get, post = kit.server.get, kit.server.post
        assert kit.estimate(bearer(kit.work)).status == 200
        assert kit.estimate({"X-API-Key": kit.work}).status == 200
        assert kit.estimate({"authorization": "bearer   " + kit.work, "x-api-key": kit.work}).status == 200
        for path in ("/v2/health/live", "/v2/health/ready", "/v2/models/estimate/ready", "/openapi.yaml"):
            assert get(path).status == 200, path
        for path in ("/v2", "/metrics", "/v2/models/estimate", "/nothing", "/v2/models/nothing/ready", "/admin/config"):
            expect_unauthorized(get(path), "a key is needed")
        expect_unauthorized(post("/v2/health/live"), "a key is needed")
        expect_error(get("/nothing", headers=bearer(kit.work)), 404, "not_found", "there is no")
        expect_error(kit.estimate(bearer(kit.jobs)), 403, "forbidden", "key batch: has not the scope infer")
        expect_error(get("/metrics", headers=bearer(kit.work)), 403, "forbidden", "the scope admin")
        assert kit.metric("gnpd_principal_requests_total{principal=\"worker\",class=\"2xx\"}") == 3
        assert kit.metric("gnpd_principal_requests_total{principal=\"batch\",class=\"4xx\"}") == 1
        assert kit.metric("gnpd_principal_points_total{principal=\"worker\"}") == 3 * len(SMALL) // 3
        assert kit.metric("gnpd_principal_active_requests{principal=\"boss\"}") == 1
        assert kit.metric(REJECTED % "unauthorized") == 7
        assert kit.metric(REJECTED % "forbidden") == 2


def test_bad_credentials():
    with Kit() as kit:
        for headers, text in (({"Authorization": "Bearer " + new_key()}, "not known"), ({"X-API-Key": kit.work[:-1]}, "not known"),
                              ({"X-API-Key": kit.work + "0"}, "not known"), ({"Authorization": "Basic YTpi"}, "need \"Bearer KEY\""),
                              ({"Authorization": "Bearer"}, "need \"Bearer KEY\""), ({"Authorization": "Bearer a b"}, "malformed"),
                              ({"Authorization": "Bearer " + "a" * 513}, "malformed"), ({"X-API-Key": ""}, "malformed"),
                              ({"X-API-Key": "k\x01"}, "malformed"), ({"X-API-Key": "\u00e4\u00f6"}, "malformed"),
                              ({"X-API-Key": kit.jobs, "Authorization": "Bearer " + kit.work}, "two different keys"),
                              ({"Authorization": "Bearer " + kit.work, "authorization": "Bearer " + kit.work}, "got 2 headers")):
            response = kit.server.get("/v2", headers=headers)
            expect_unauthorized(response, text)
            assert kit.work not in response.text and kit.jobs not in response.text
        for key in (kit.work, kit.jobs, kit.admin):
            assert key not in kit.server.log()


def test_no_body_is_taken_from_strangers():
    """401 comes before the body: at once where the client waits to be asked, and without holding memory for what is sent."""
    with Kit() as kit:
        with kit.server.connect() as s:
            s.sendall(b"POST /v1/estimate HTTP/1.1\r\nHost: localhost\r\nContent-Length: 100000000\r\nExpect: 100-continue\r\n\r\n")
            expect_unauthorized(harness.read_response(s))
        with kit.server.connect() as s:
            s.sendall(b"POST /v1/estimate HTTP/1.1\r\nHost: localhost\r\nContent-Length: 2000000\r\n\r\n" + b"x" * 1_000_000)
            harness.eventually(lambda: kit.metric("gnpd_connections") >= 2)
            time.sleep(0.1)
            assert kit.metric("gnpd_queue_bytes") == 0
            s.sendall(b"x" * 1_000_000)
            expect_unauthorized(harness.read_response(s))


def test_concurrency_of_a_key():
    headers, body = harness.points_body(harness.sphere(300_000 if SLOW == 1 else 60_000), estimator="gmls", cover="all")
    with Kit(limits="concurrency=1") as kit:
        request = harness.make_request("POST", ESTIMATE, body, dict(headers, **bearer(kit.work)))
        with kit.server.connect() as held:
            held.sendall(request)
            harness.eventually(lambda: kit.metric("gnpd_principal_active_requests{principal=\"worker\"}") == 1, 20)
            response = kit.server.get("/v2", headers=bearer(kit.work))
            expect_error(response, 429, "limited", "key worker: 1 requests are under way, at most 1 may be (concurrency)")
            assert int(response.headers["retry-after"]) >= 1
            assert kit.server.get("/v2", headers=bearer(kit.admin)).status == 200
            assert kit.server.get("/v2/health/live").status == 200
        harness.eventually(lambda: kit.metric("gnpd_principal_active_requests{principal=\"worker\"}") == 0, 20)
        assert kit.server.get("/v2", headers=bearer(kit.work)).status == 200
        assert kit.metric("gnpd_principal_limited_total{principal=\"worker\",limit=\"concurrency\"}") == 1
        assert kit.metric(REJECTED % "key_concurrency") == 1


def test_rate_of_a_key():
    with Kit(limits="rate=30/m burst=3") as kit:
        with kit.server.connect() as s:
            answers = [kit.server.get("/v2", headers=bearer(kit.work), connection=s) for _ in range(5)]
        assert [a.status for a in answers] == [200, 200, 200, 429, 429]
        expect_error(answers[3], 429, "limited", "key worker: over 0.5 requests a second after 3 at once (rate, burst)")
        assert answers[3].headers["retry-after"] == "2", answers[3].headers
        assert kit.metric("gnpd_principal_limited_total{principal=\"worker\",limit=\"rate\"}") == 2
        assert kit.metric(REJECTED % "key_rate") == 2
        time.sleep(2.05)
        assert kit.server.get("/v2", headers=bearer(kit.work)).status == 200
        assert kit.server.get("/v2", headers=bearer(kit.work)).status == 429


def test_keys_change_while_requests_run():
    """A new key beside the old one, then the old one gone: nobody is refused in between, and a bad file changes nothing."""
    with Kit() as kit:
        new, faults, halt = new_key(), [], threading.Event()

        def ask():
            with kit.server.connect() as s:
                while not halt.is_set():
                    status = kit.server.get("/v2", headers=bearer(kit.admin), connection=s).status
                    if status != 200:
                        faults.append(status)
        threads = [threading.Thread(target=ask) for _ in range(2)]
        for thread in threads:
            thread.start()
        boss = line("boss", kit.admin, "admin,infer")

        def reload(text, result, mode=0o600):
            before = kit.metric("gnpd_keys_reloads_total{result=\"%s\"}" % result)
            kit.folder.put("keys", text, mode)
            kit.server.signal(signal.SIGHUP)
            harness.eventually(lambda: kit.metric("gnpd_keys_reloads_total{result=\"%s\"}" % result) == before + 1)
        try:
            reload("worker %s,%s infer\n" % (credentials.hash_of(kit.work), credentials.hash_of(new)) + boss, "ok")
            for key in (kit.work, new):
                assert kit.server.get("/v2", headers=bearer(key)).status == 200
            expect_unauthorized(kit.server.get("/v2", headers=bearer(kit.jobs)), "not known")
            reload(line("worker", new, "infer") + boss, "ok")
            expect_unauthorized(kit.server.get("/v2", headers=bearer(kit.work)), "not known")
            assert kit.metric("gnpd_principal_requests_total{principal=\"worker\",class=\"2xx\"}") == 2, "a name keeps its counts"
            for text, mode in (("nonsense\n", 0o600), ("", 0o600), (line("worker", kit.work, "infer"), 0o644)):
                reload(text, "failed", mode)
                assert kit.server.get("/v2", headers=bearer(new)).status == 200
                expect_unauthorized(kit.server.get("/v2", headers=bearer(kit.work)), "not known")
        finally:
            halt.set()
            for thread in threads:
                thread.join()
        assert not faults, faults
        log = kit.server.log()
        assert log.count("reload: keys: what is in use stays: keys-file: ") == 3, log
        for text in ("line 1: need NAME sha256:HASH SCOPES", "got no key", "got mode 0644, which lets others read or write it"):
            assert text in log, text


def test_log_tells_the_principal():
    with Kit(log_format="json") as kit:
        kit.server.get("/v2", headers=dict(bearer(kit.work), **{"X-Request-Id": "my-own-id"}))
        kit.server.get("/v2/health/live")
        harness.eventually(lambda: "my-own-id" in kit.server.log())
        lines = [json.loads(text) for text in kit.server.log().splitlines()]
        mine = [entry for entry in lines if entry.get("request_id") == "my-own-id"]
        assert mine[0]["principal"] == "worker" and mine[0]["status"] == 200, mine
        assert all(entry["principal"] == "" for entry in lines if entry.get("path") == "/v2/health/live")


def gnpd(*flags):
    return subprocess.run([harness.BINARY, *flags], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, timeout=20 * SLOW)


def test_key_made_by_the_daemon_opens_it():
    done = gnpd("--make-key", "carol")
    key, text = done.stdout.splitlines()
    assert done.returncode == 0 and len(key) == 69 and text == "carol %s infer,jobs" % credentials.hash_of(key), done
    assert gnpd("--make-key", "carol").stdout.splitlines()[0] != key
    bad = gnpd("--make-key", "two words")
    assert bad.returncode == 1 and "name: got \"two words\"" in bad.stderr
    with credentials.Folder() as folder:
        with harness.Server(keys_file=folder.put("keys", text + "\n")) as server:
            assert server.get("/v2", headers=bearer(key)).status == 200


def test_files_of_keys_that_are_no_good():
    with credentials.Folder() as folder:
        good = line("a", new_key(), "infer")
        for content, mode, text in ((good, 0o644, "got mode 0644"), (good, 0o660, "got mode 0660"), (good, 0o602, "got mode 0602"),
                                    ("a b\n", 0o600, "line 1: need NAME"), ("\n" + good + good, 0o600, "line 3: name: \"a\" is given twice"),
                                    ("#\n", 0o600, "got no key")):
            done = gnpd("--check-config", "--keys-file", folder.put("keys", content, mode))
            assert done.returncode == 1 and text in done.stderr, (content, done.stderr)
        assert "No such file" in gnpd("--check-config", "--keys-file", folder.name("none")).stderr
        assert "not a regular file" in gnpd("--check-config", "--keys-file", folder.path).stderr
        assert gnpd("--check-config", "--keys-file", folder.put("keys", good, 0o640)).returncode == 0


def test_beyond_loopback_only_with_keys():
    with credentials.Folder() as folder:
        path = folder.put("keys", line("a", new_key(), "infer"))
        assert "need a loopback address" in gnpd("--check-config", "--listen", "0.0.0.0:0").stderr
        assert "admin-listen: got \"0.0.0.0:0\"" in gnpd("--check-config", "--admin-listen", "0.0.0.0:0").stderr
        assert gnpd("--check-config", "--listen", "0.0.0.0:0", "--admin-listen", "0.0.0.0:0", "--keys-file", path).returncode == 0
        with harness.Server(listen="0.0.0.0:0", keys_file=path) as server:
            harness.eventually(lambda: "without TLS" in server.log(), what="the warning")
            expect_unauthorized(server.get("/v2"))


def test_connections_of_an_address():
    with harness.Server(max_connections_per_address=3) as server:
        held = [server.connect() for _ in range(3)]
        for s in held:
            assert server.get("/v2/health/live", connection=s).status == 200
        fourth = server.connect()
        answer = fourth.recv(65536)
        assert answer.startswith(b"HTTP/1.1 429 ") and b"at most 3 may be (max-connections-per-address)" in answer, answer
        metrics = server.get("/metrics", connection=held[0]).text
        assert "gnpd_rejected_total{reason=\"connections_per_address\"} 1\n" in metrics
        held.pop().close()

        def has_room():
            with server.connect() as s:
                try:
                    return server.get("/v2/health/live", connection=s).status == 200
                except ConnectionError:
                    return False
        harness.eventually(has_room)
        for s in held + [fourth]:
            s.close()


def test_memory_of_a_request_is_bounded():
    with harness.Server(request_memory_bytes=20_000_000) as server:
        headers, body = harness.points_body(SMALL)
        assert server.post(ESTIMATE, body, headers).status == 200
        headers, body = harness.points_body(harness.sphere(100_000))
        expect_error(server.post(ESTIMATE, body, headers), 413, "too_large", "need at most 20000000 (request-memory-bytes)")
        assert server.metric(REJECTED % "request_memory") == 1
        server.wait_metric("gnpd_queue_bytes", 0)


def test_decoded_bytes_and_points_have_limits_of_their_own():
    with harness.Server(max_decoded_bytes=100_000, max_points=5000) as server:
        big = gzip.compress(harness.ply(harness.sphere(20_000)))
        response = server.post("/v1/estimate", big, {"Content-Encoding": "gzip"})
        expect_error(response, 413, "too_large", "decompresses to more than 100000 bytes")
        assert server.metric(REJECTED % "body_limit") == 1 and server.metric(REJECTED % "points") == 0
        expect_error(server.post("/v1/estimate", harness.ply(harness.sphere(5001))), 413, "too_large", "points: got 5001, need at most 5000")
        assert server.metric(REJECTED % "points") == 1
        assert server.metric("gnpd_limit{key=\"max-points\"}") == 5000
