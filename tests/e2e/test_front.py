"""What stands before every request: names and pages, forms of targets, one spelling of paths, refused bodies, streams that end."""
import re
import socket
import time

import credentials
import harness
from credentials import bearer
from harness import SLOW, eventually, expect_error
from test_admin import Admin

CLOUD = harness.ply(harness.sphere(600))
QUICK = "estimate?estimator=gmls"
CHANGES = (("POST", "/v1/estimate"), ("POST", "/v1/jobs/estimate"), ("POST", "/v2/models/estimate/infer"), ("DELETE", "/v1/jobs/" + 30 * "0"),
           ("PUT", "/v1/jobs"), ("POST", "/v2/repository/index"))


def exchange(server, method, path, host="localhost", headers=(), body=b"", version="1.1", port=None):
    """One exchange, with what is said of Host: None for nothing."""
    lines = ["%s %s HTTP/%s" % (method, path, version), "Connection: close"] + ([] if host is None else ["Host: " + host])
    lines += ["%s: %s" % item for item in dict(headers).items()] + (["Content-Length: %d" % len(body)] if body else [])
    with socket.create_connection(("127.0.0.1", port or server.port), 20 * SLOW) as s:
        s.sendall("\r\n".join(lines).encode() + b"\r\n\r\n" + body)
        return harness.read_response(s, method)


# ---- Names ----

def test_rebound_names_are_refused():
    """A page whose name resolves to this machine is this server's own for a browser: it could read and delete jobs."""
    with Admin() as kit:
        server = kit.server
        job = server.post("/v1/jobs/" + QUICK, CLOUD).json["id"]
        for method, path in (("GET", "/v2/health/live"), ("GET", "/v1/jobs"), ("DELETE", "/v1/jobs/" + job), ("POST", "/v1/estimate"), ("GET", "/nothing"),
                             ("OPTIONS", "*")):
            for host in ("evil.example", "evil.example:%d" % server.port, "127.0.0.1.evil.example"):
                expect_error(exchange(server, method, path, host), 403, "forbidden", "host: got \"%s\", need localhost" % host, "allowed-hosts")
        expect_error(exchange(server, "GET", "/metrics", "evil.example", port=kit.port), 403, "forbidden", "host: got \"evil.example\"")
        expect_error(exchange(server, "PUT", "/admin/log-level?level=debug", "evil.example", port=kit.port), 403, "forbidden")
        expect_error(exchange(server, "GET", "/v2", "a b"), 400, "invalid_argument", "host: got \"a b\", need NAME or NAME:PORT")
        assert server.get("/v1/jobs/" + job).status == 200
        assert server.metric("gnpd_rejected_total{reason=\"host\"}") == 21
        for host in ("localhost", "localhost:1", "LOCALHOST.", "a.localhost", "127.0.0.1:%d" % server.port, "192.0.2.7", "[::1]:8080"):
            assert exchange(server, "GET", "/v2", host).status == 200
            assert exchange(server, "GET", "/metrics", host, port=kit.port).status == 200
        for host in (None, ""):  # checks of load balancers
            assert exchange(server, "GET", "/v2/health/ready", host, version="1.0").status == 200


def test_names_that_are_allowed():
    with Admin(allowed_hosts="gnp.example.org, other") as kit:
        for host in ("gnp.example.org", "GNP.example.org:443", "other", "localhost"):
            assert exchange(kit.server, "GET", "/v2", host).status == 200
            assert exchange(kit.server, "GET", "/metrics", host, port=kit.port).status == 200
        expect_error(exchange(kit.server, "GET", "/v2", "example.org"), 403, "forbidden", "or one of gnp.example.org, other (allowed-hosts)")
    with harness.Server(allowed_hosts="*") as server:
        assert exchange(server, "GET", "/v2", "evil.example").status == 200
    with harness.Server(listen="0.0.0.0:0", insecure="true") as server:
        assert exchange(server, "GET", "/v2", "gnp.example.org").status == 200
        assert "is open without keys under any name" in server.log()
    with harness.Server(listen="0.0.0.0:0", insecure="true", allowed_hosts="gnp.example.org") as server:
        expect_error(exchange(server, "GET", "/v2", "evil.example"), 403, "forbidden")
        assert "under any name" not in server.log()


def test_keys_stand_for_names():
    """A rebound page has no key; what the admin listener tells without one it does not tell it."""
    key = credentials.new_key()
    with credentials.Folder() as folder:
        keys = folder.put("keys", credentials.line("alice", key, "infer,jobs,admin"))
        with Admin(keys_file=keys) as kit:
            assert exchange(kit.server, "GET", "/v2/health/live", "gnp.example.org").status == 200
            assert exchange(kit.server, "GET", "/v2", "gnp.example.org", bearer(key)).status == 200
            expect_error(exchange(kit.server, "GET", "/v2", "evil.example"), 401, "unauthorized")
            expect_error(exchange(kit.server, "GET", "/metrics", "evil.example", port=kit.port), 403, "forbidden")
            page = dict(bearer(key), Origin="https://app.example", **{"Sec-Fetch-Site": "cross-site"})
            assert exchange(kit.server, "POST", "/v1/" + QUICK, "localhost", page, CLOUD).status == 200


# ---- Pages ----

def test_pages_of_other_sites_change_nothing():
    """A page may send a form's request anywhere: jobs were submitted by it."""
    with Admin() as kit:
        server, own = kit.server, "localhost:%d" % kit.server.port
        foreign = ({"Origin": "http://evil.example"}, {"Origin": "null"}, {"Origin": "http://localhost:3000"}, {"Sec-Fetch-Site": "cross-site"},
                   {"Sec-Fetch-Site": "same-site", "Origin": "http://localhost:3000"}, {"Sec-Fetch-Site": "cross-site", "Origin": "http://" + own})
        for method, path in CHANGES:
            for headers in foreign:
                expect_error(exchange(server, method, path, own, dict(headers, **{"Content-Type": "text/plain"}), CLOUD), 403, "forbidden",
                             "pages of other sites may not change anything here")
        expect_error(exchange(server, "POST", "/admin/reload", "127.0.0.1", foreign[0], port=kit.port), 403, "forbidden", "Origin: got \"http://evil.example\"")
        assert server.metric("gnpd_jobs_submitted_total") == 0
        assert server.metric("gnpd_rejected_total{reason=\"cross_site\"}") == len(CHANGES) * len(foreign) + 1
        for headers in ({}, {"Origin": "http://" + own}, {"Sec-Fetch-Site": "same-origin", "Origin": "http://" + own}, {"Sec-Fetch-Site": "none"}):
            assert exchange(server, "POST", "/v1/" + QUICK, own, headers, CLOUD).status == 200
        for headers in foreign:  # what changes nothing, and tells a page nothing
            response = exchange(server, "GET", "/v2", own, headers)
            assert response.status == 200 and "access-control-allow-origin" not in response.headers
        expect_error(exchange(server, "POST", "/v1/" + QUICK, own, {"Origin": "http://a", "origin": "http://" + own}, CLOUD), 400, "invalid_argument",
                     "Origin: got 2 headers")


def test_pages_behind_a_proxy_that_changes_the_name():
    with harness.Server(allowed_hosts="gnp.example.org") as server:
        for origin, status in (("https://gnp.example.org", 200), ("https://evil.example", 403)):
            assert exchange(server, "POST", "/v1/" + QUICK, "127.0.0.1:8080", {"Origin": origin}, CLOUD).status == status


# ---- Targets ----

def test_absolute_targets(server):
    """RFC 9112 3.2.2: a server must take them, and the target's name counts, not Host's."""
    for start in ("http://localhost", "HTTP://127.0.0.1:%d" % server.port, "https://[::1]"):
        assert exchange(server, "GET", start + "/v2?a=1", "evil.example").json["name"] == "gnpd"
    expect_error(exchange(server, "GET", "http://evil.example/v2"), 403, "forbidden", "host: got \"evil.example\"")
    expect_error(exchange(server, "GET", "http://user@localhost/v2"), 400, "invalid_argument", "host: got \"user@localhost\"")
    for path in ("http://localhost", "http://localhost/", "http://localhost?a=1", "http://localhost/v2/", "ftp://localhost/v2"):
        expect_error(exchange(server, "GET", path), 404, "not_found", "path: there is no")
    response = exchange(server, "POST", "http://localhost/v1/" + QUICK, body=CLOUD)
    assert response.status == 200 and response.body.startswith(b"ply")
    assert "\"POST\" \"/v1/estimate\" 200" in server.log()


def test_options_of_the_whole_server():
    with Admin() as kit:
        response = exchange(kit.server, "OPTIONS", "*")
        assert response.status == 204 and response.headers["allow"] == "GET, HEAD, POST, DELETE, OPTIONS" and not response.body
        assert exchange(kit.server, "OPTIONS", "*", port=kit.port).headers["allow"] == "GET, HEAD, POST, PUT, OPTIONS"
        expect_error(exchange(kit.server, "GET", "*"), 405, "method_not_allowed", "method: got GET, need OPTIONS")


def test_paths_have_one_spelling(server):
    """Whoever guards some paths in front of this server must not have to know of others."""
    job = server.post("/v1/jobs/" + QUICK, CLOUD).json["id"]
    for path in ("//v2///health/live", "/v2/health/live/", "//v2/health/live", "/v2//health/live", "/v1/jobs/", "/v1//jobs", "/v1/jobs/%s/" % job, "/v2/",
                 "/v2/health/l%69ve", "/%762", "/v2/./health/live", "/v2/models/../health/live", "/V2", "/v2;a=1", "/v2/models/%"):
        expect_error(server.get(path), 404, "not_found", "path: there is no \"%s\"" % path)
    assert server.post("/v1/estimate/?estimator=gmls", CLOUD).status == 404
    for query in ("estimator=gmls&&k=30", "&estimator=gmls", "estimator=gmls&"):
        expect_error(server.post("/v1/estimate?" + query, CLOUD), 400, "invalid_argument", "query: got \"\", need name=value")
    expect_error(server.get("/v1/jobs?limit=1&"), 400, "invalid_argument", "query: got \"\", need name=value")
    assert server.get("/v1/jobs?").status == 200


# ---- Bodies ----

def test_forms_are_told_what_to_do(server):
    form = b"--x\r\nContent-Disposition: form-data; name=\"file\"; filename=\"a.ply\"\r\n\r\n" + CLOUD + b"\r\n--x--\r\n"
    for path in ("/v1/" + QUICK, "/v1/jobs/" + QUICK, "/v2/models/estimate/infer"):
        for kind in ("multipart/form-data; boundary=x", "Multipart/Mixed;boundary=x"):
            expect_error(server.post(path, form, {"Content-Type": kind}), 415, "unsupported_media", "is that of a form, need the file alone",
                         "--data-binary @FILE")


def closes(s, seconds=5):
    """Nothing more comes, and the end is no reset."""
    s.settimeout(seconds * SLOW)
    return s.recv(1) == b""


def test_a_refused_body_is_sent_whole_before_the_answer_is_read():
    """What did not fit discard-bytes was reset under way: clients and proxies saw no answer."""
    big = bytes(64 << 20)
    with harness.Server(max_body_bytes="1M", discard_bytes="64K") as server:
        chunked = b"".join([b"100000\r\n" + big[:1 << 20] + b"\r\n"] * 64) + b"0\r\n\r\n"
        for method, path, headers, body, status, code in (
                ("POST", "/v1/estimate", {}, big, 413, "too_large"), ("POST", "/nothing", {}, big, 404, "not_found"),
                ("PUT", "/v1/estimate", {}, big, 405, "method_not_allowed"), ("GET", "/v2", {}, big, 413, "too_large"),
                ("POST", "/v1/estimate", {"Content-Type": "multipart/form-data"}, big[:1 << 20], 415, "unsupported_media"),
                ("POST", "/v1/estimate", {"Transfer-Encoding": "chunked"}, chunked, 413, "too_large"),
                ("POST", "/nothing", {"Transfer-Encoding": "chunked"}, chunked, 404, "not_found")):
            with server.connect() as s:
                s.sendall(harness.make_request(method, path, body, headers))
                response = harness.read_response(s, method)
                expect_error(response, status, code)
                assert response.closed and closes(s)
                assert status != 405 or response.headers["allow"] == "POST"
        with server.connect() as s:
            s.sendall(harness.make_request("HEAD", "/nothing", big))
            response = harness.read_response(s, "HEAD")
            assert response.status == 404 and int(response.headers["content-length"]) > 50 and closes(s)
        eventually(lambda: server.log().count("\" 413 too_large ") == 3 and server.log().count("\" 404 not_found ") == 3)
        assert " 499 " not in server.log()
        server.wait_metric("gnpd_connections", 1)


def test_a_refused_body_over_tls_too():
    with credentials.Folder() as folder:
        pem, key = credentials.certificate(folder, "one")
        with harness.Server(tls_certificate=pem, tls_key=key, max_body_bytes="1M", discard_bytes="64K") as server:
            for length in (True, False):
                with credentials.connect(server, pem) as s:
                    if length:
                        s.sendall(harness.make_request("POST", "/v1/estimate", bytes(16 << 20)))
                    else:
                        s.sendall(harness.make_request("POST", "/v1/estimate", b"", {"Transfer-Encoding": "chunked"}))
                        for _ in range(16):
                            s.sendall(b"100000\r\n" + bytes(1 << 20) + b"\r\n")
                        s.sendall(b"0\r\n\r\n")
                    expect_error(harness.read_response(s), 413, "too_large")
                    assert closes(s)


def test_the_answer_comes_at_once():
    """Who looks while it sends need not send the rest."""
    with harness.Server(max_body_bytes="1M", discard_bytes="64K") as server:
        with server.connect(2) as s:
            s.sendall(harness.make_request("POST", "/v1/estimate", b"", {"Content-Length": 1 << 40}))
            expect_error(harness.read_response(s), 413, "too_large", "body: got 1099511627776 bytes")
            assert closes(s)
        server.wait_metric("gnpd_connections", 1)
        with server.connect() as s:  # as short a one as discard-bytes: the connection goes on
            for _ in range(3):
                s.sendall(harness.make_request("POST", "/nothing", bytes(65536)))
                response = harness.read_response(s)
                assert response.status == 404 and not response.closed


def pour(s, piece=bytes(1 << 16)):
    """Sends for as long as it is taken: bytes and seconds."""
    sent, began = 0, time.monotonic()
    try:
        while time.monotonic() - began < 20:
            sent += s.send(piece)
    except (BrokenPipeError, ConnectionResetError):
        pass
    return sent, time.monotonic() - began


def test_what_is_dropped_is_bounded():
    with harness.Server(max_body_bytes="1M", discard_bytes="64K", linger_bytes="8M", linger_seconds=600) as server:
        with server.connect() as s:
            s.sendall(harness.make_request("POST", "/v1/estimate", b"", {"Content-Length": 1 << 40}))
            assert harness.read_response(s).status == 413
            sent, seconds = pour(s)
            assert 8 << 20 < sent < 64 << 20 and seconds < 10, (sent, seconds)
        server.wait_metric("gnpd_connections", 1)
    with harness.Server(max_body_bytes="1M", discard_bytes="64K", linger_bytes="1T", linger_seconds=0.5) as server:
        with server.connect() as busy, server.connect() as idle:
            for s in (busy, idle):
                s.sendall(harness.make_request("POST", "/v1/estimate", b"", {"Content-Length": 1 << 40}))
                assert harness.read_response(s).status == 413
            assert 0.3 < pour(busy)[1] < 3 * SLOW
            server.wait_metric("gnpd_connections", 1)
        assert server.metric("gnpd_rejected_total{reason=\"slow_reply\"}") == 0 and " 408 " not in server.log()


def test_a_body_that_is_dropped_does_not_hold_the_end_up():
    with harness.Server(discard_bytes=0, linger_seconds=600) as server:
        with server.connect() as s:
            s.sendall(harness.make_request("POST", "/nothing", b"", {"Content-Length": 1 << 40}))
            assert harness.read_response(s).status == 404
            began = time.monotonic()
            server.signal()
            assert server.wait(5) == 0 and time.monotonic() - began < 2 * SLOW


# ---- Streams ----

def events(server, job, last=None):
    """Head and body of a job's stream, read to its end."""
    with server.connect() as s:
        s.sendall(harness.make_request("GET", "/v1/jobs/%s/events" % job, headers=dict({"Connection": "close"}, **({"Last-Event-ID": last} if last else {}))))
        data = b""
        while part := s.recv(65536):
            data += part
    return data.decode().split("\r\n\r\n", 1)


def test_a_browser_learns_that_a_job_is_over(server):
    """EventSource asks again after each end, with the last id it has: 204 says that nothing follows."""
    job = server.post("/v1/jobs/" + QUICK, CLOUD).json["id"]
    head, body = events(server, job)
    assert head.startswith("HTTP/1.1 200") and "X-Accel-Buffering: no" in head
    ids = re.findall(r"^id: (.+?)\r?$", body, re.M)
    assert ids[-1].endswith(".succeeded") and "\"state\":\"succeeded\"" in body, body
    assert events(server, job, ids[-1])[0].startswith("HTTP/1.1 204")
    for other in ("1", "0.running", ids[-1] + "x", "99.succeeded"):
        head, body = events(server, job, other)
        assert head.startswith("HTTP/1.1 200") and "\"state\":\"succeeded\"" in body, (other, head)
    server.wait_metric("gnpd_jobs_watches", 0)
