"""The admin listener: what it answers, to whom, and that no work and no crowd at the other listener keeps it from answering."""
import socket
import time

import credentials
import harness
from credentials import bearer
from harness import SLOW, expect_error

ESTIMATE = "/v2/models/estimate/infer"
HEALTH_LIMIT = 0.05 * SLOW


class Admin:
    """A daemon with an admin listener."""

    def __init__(self, **flags):
        self.folder = credentials.Folder()
        self.folder.__enter__()
        self.server = harness.Server(admin_listen="127.0.0.1:0", admin_port_file=self.folder.name("port"), **flags)
        self.port = int(self.folder.read("port"))

    def __enter__(self):
        return self

    def __exit__(self, *fault):
        self.server.__exit__(*fault)
        self.folder.__exit__()

    def connect(self):
        return socket.create_connection(("127.0.0.1", self.port), 20 * SLOW)

    def request(self, method, path, headers=None, connection=None):
        with connection or self.connect() as s:
            s.sendall(harness.make_request(method, path, b"" if method != "GET" else None, headers))
            return harness.read_response(s, method)

    def get(self, path, headers=None):
        return self.request("GET", path, headers)


def test_what_the_admin_listener_answers():
    with Admin(queue_count=7) as admin:
        assert admin.port != admin.server.port
        for path in ("/v2/health/live", "/v2/health/ready", "/metrics", "/v2", "/admin/config", "/admin/log-level", "/admin/reload"):
            assert admin.get(path).status == 200, path
        for path in ("/v2/models/estimate", "/openapi.yaml", "/nothing"):
            expect_error(admin.get(path), 404, "not_found")
        expect_error(admin.request("POST", ESTIMATE), 404, "not_found")
        for path in ("/admin/config", "/admin/log-level", "/admin/reload"):
            expect_error(admin.server.get(path), 404, "not_found")
        assert admin.server.get("/metrics").status == 200
        assert "\nqueue-count = 7\n" in admin.get("/admin/config").text
        response = admin.request("DELETE", "/admin/log-level")
        expect_error(response, 405, "method_not_allowed")
        assert response.headers["allow"] == "GET, HEAD, PUT", response.headers


def test_log_level_changes_while_running():
    with Admin(log_level="warning") as admin:
        server = admin.server

        def logged(mark):
            server.get("/v2?" + mark, headers={"X-Request-Id": mark})
            time.sleep(0.05)
            return mark in server.log()
        assert not logged("quiet-1") and "ready with" not in server.log()
        assert admin.get("/admin/log-level").json == {"level": "warning"}
        assert admin.request("PUT", "/admin/log-level?level=info").json == {"level": "info"}
        assert logged("heard-1") and "log-level: info from now on" in server.log()
        for query in ("", "?level=loud", "?level=info&x=1", "?level", "?level=infox"):
            expect_error(admin.request("PUT", "/admin/log-level" + query), 400, "invalid_argument")
        assert admin.request("PUT", "/admin/log-level?level=error").status == 200
        assert not logged("quiet-2")
        assert admin.request("PUT", "/admin/log-level?level=debug").status == 200
        with server.connect() as s:
            s.sendall(b"GET /v2 HTTP/1.1\r\n\r\n")
            s.recv(1000)
        harness.eventually(lambda: " debug: http: " in server.log(), what="what the library says")


def test_log_level_in_effect_is_in_the_configuration():
    """It said what the level was at the start."""
    with Admin(log_level="info") as admin:
        before = admin.get("/admin/config").text
        assert "\nlog-level = info\n" in before
        assert admin.request("PUT", "/admin/log-level?level=warning").status == 200
        assert admin.get("/admin/config").text == before.replace("log-level = info", "log-level = warning")


def test_errors_of_the_log_level_name_the_culprit():
    """?foo=1&level=info was answered with: level: got "info"."""
    with Admin() as admin:
        for query, text in (("?foo=1&level=info", 'unknown parameter "foo", known: level'), ("?level=info&x=1", 'unknown parameter "x", known: level'),
                            ("", "level: is not given, need error, warning, info or debug"),
                            ("?level=loud", 'level: got "loud", need error, warning, info or debug'), ("?level=info&level=info", 'query: "level" is given twice')):
            expect_error(admin.request("PUT", "/admin/log-level" + query), 400, "invalid_argument", text)
        assert admin.get("/admin/log-level").json == {"level": "info"}


def test_reload_by_the_admin_listener():
    with Admin() as admin:
        assert admin.get("/admin/reload").json["done"] == 0
        response = admin.request("POST", "/admin/reload")
        assert response.status == 202 and response.json == {"reload": 1} and response.headers["location"] == "/admin/reload"
        harness.eventually(lambda: admin.get("/admin/reload").json["done"] == 1)
        assert admin.get("/admin/reload").json == {"asked": 1, "done": 1, "keys": "ok", "certificate": "ok", "weights": "ok"}
        admin.server.put_weights("bad\udcff.safetensors", b"\x00" * 20)
        admin.request("POST", "/admin/reload")
        harness.eventually(lambda: admin.get("/admin/reload").json["done"] == 2)
        assert "bad\ufffd.safetensors" in admin.get("/admin/reload").json["weights"], "a name that is no UTF-8 is JSON all the same"


def test_keys_at_the_admin_listener():
    worker, boss = credentials.new_key(), credentials.new_key()
    with credentials.Folder() as folder:
        path = folder.put("keys", credentials.line("worker", worker, "infer,jobs") + credentials.line("boss", boss, "admin"))
        with Admin(keys_file=path) as admin:
            for free in ("/v2/health/live", "/metrics"):
                assert admin.get(free).status == 200
            expect_error(admin.server.get("/metrics"), 401, "unauthorized")
            for path in ("/admin/config", "/admin/reload", "/admin/log-level", "/nothing"):
                expect_error(admin.get(path), 401, "unauthorized")
            expect_error(admin.request("POST", "/admin/reload"), 401, "unauthorized")
            expect_error(admin.get("/admin/config", bearer(worker)), 403, "forbidden", "the scope admin")
            text = admin.get("/admin/config", bearer(boss)).text
            assert "keys-file = " in text and boss not in text and credentials.hash_of(boss) not in text


def test_crowds_do_not_shut_administrators_out():
    """All connections, runners and places in the queue of the other listener are taken."""
    count = 400_000 if SLOW == 1 else 200_000
    headers, body = harness.points_body(harness.sphere(count), estimator="gmls", cover="all")
    request = harness.make_request("POST", ESTIMATE, body, headers)
    with Admin(workers=2, runners=1, queue_count=2, max_connections=8, http_threads=2, drain_seconds=0) as admin:
        held = []
        for s in (admin.server.connect(60) for _ in range(3)):
            s.sendall(request)
            held.append(s)

        def metric(name):
            return next(float(text.rsplit(" ", 1)[1]) for text in admin.get("/metrics").text.splitlines() if text.startswith(name + " "))
        harness.eventually(lambda: metric("gnpd_queue_requests") == 2, 20)
        held += [admin.server.connect() for _ in range(30)]
        harness.eventually(lambda: metric("gnpd_connections") >= 8)
        worst = 0.0
        for path in ("/v2/health/live", "/metrics", "/v2/health/ready") * 10:
            started = time.monotonic()
            assert admin.get(path).status == 200
            worst = max(worst, time.monotonic() - started)
        assert metric("gnpd_queue_requests") == 2, "the queue was not full to the end"
        assert worst < HEALTH_LIMIT, "%.3f s" % worst
        for s in held:
            s.close()


def test_administrators_have_a_limit_of_their_own():
    with Admin(admin_connections=2) as admin:
        held = [admin.connect() for _ in range(2)]
        for s in held:
            s.sendall(harness.make_request("GET", "/v2/health/live"))
            assert harness.read_response(s).status == 200
        assert admin.server.get("/v2/health/live").status == 200
        third = admin.connect()
        third.settimeout(0.3)
        third.sendall(harness.make_request("GET", "/v2/health/live"))
        try:
            assert third.recv(1000) == b"", "a third was answered"
        except (socket.timeout, ConnectionError):
            pass
        for s in held + [third]:
            s.close()
        harness.eventually(lambda: admin.get("/v2/health/live").status == 200)


def test_drain_is_seen_at_the_admin_listener():
    count = 150_000 if SLOW == 1 else 60_000
    headers, body = harness.points_body(harness.sphere(count), estimator="gmls", cover="all")
    with Admin(workers=2, drain_seconds=60) as admin:
        with admin.server.connect(60) as s:
            s.sendall(harness.make_request("POST", ESTIMATE, body, headers))
            admin.server.wait_metric("gnpd_running_requests", 1, 20)
            admin.server.signal()
            harness.eventually(lambda: admin.get("/v2/health/ready").status == 503, 2)
            assert admin.get("/v2/health/live").status == 200 and admin.get("/metrics").status == 200
            assert harness.read_response(s).status == 200
        assert admin.server.wait(5) == 0
