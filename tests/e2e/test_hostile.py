"""Framing attacks, slow clients, overload, vanished clients, and the end of the daemon."""
import os
import re
import selectors
import signal
import socket
import subprocess
import threading
import time

import harness
from harness import SLOW, expect_error

ESTIMATE = "/v2/models/estimate/infer"
SMALL = harness.sphere(600)
HEALTH_LIMIT = 0.05 * SLOW


def long_request(count=400_000 if SLOW == 1 else 60_000, **parameters):
    """A request whose work takes seconds on one worker."""
    cloud = harness.sphere(count)
    headers, body = harness.points_body(cloud, **dict({"estimator": "gmls", "cover": "all"}, **parameters))
    return harness.make_request("POST", ESTIMATE, body, headers)


LONG = []


def send_long(server):
    if not LONG:
        LONG.append(long_request())
    s = server.connect(60)
    s.sendall(LONG[0])
    return s


def worst_health(server, rounds=30):
    worst = 0.0
    for path in ("/v2/health/live", "/v2/health/ready", "/metrics"):
        for _ in range(rounds // 3):
            started = time.monotonic()
            response = server.get(path)
            worst = max(worst, time.monotonic() - started)
            assert response.status == 200
    return worst


def test_ambiguous_framing(server):
    before = server.metric("gnpd_rejected_total{reason=\"framing\"}")
    cases = (
        ("Content-Length: 5\r\nContent-Length: 5\r\n", "Content-Length: got 2 headers"),
        ("Content-Length: 5\r\ncontent-length: 50\r\n", "Content-Length: got 2 headers"),
        ("Content-Length: 5\r\nTransfer-Encoding: chunked\r\n", "Content-Length and Transfer-Encoding"),
        ("Transfer-Encoding: gzip\r\n", "Transfer-Encoding other than chunked"),
        ("Transfer-Encoding: chunked\r\nTransfer-Encoding: chunked\r\n", "Transfer-Encoding: got 2 headers"),
        ("Content-Length: 5\r\nHost: b\r\n", "Host: got 2 headers"),
        ("Content-Length: 5\r\nInference-Header-Content-Length: 1\r\nInference-Header-Content-Length: 2\r\n",
         "Inference-Header-Content-Length: got 2 headers"),
        ("Content-Length : 5\r\n", "not a token"),
        (": nameless\r\nContent-Length: 5\r\n", "bytes are not lines of"),
        ("\0: nameless\r\nContent-Length: 5\r\n", ""),
        ("X-A: b\0c\r\n", "bytes are not lines of"),
        ("X-A: b\r\n\tc\r\n", "bytes are not lines of"),
        ("X-A: b\nX-B: c\r\n", "bytes are not lines of"),
        ("Content-Type: text/plain\r\ncontent-type: model/ply\r\n", "Content-Type: got 2 headers"),
        ("Content-Encoding: gzip\r\nContent-Encoding: identity\r\n", "Content-Encoding: got 2 headers"),
        ("Idempotency-Key: a\r\nIdempotency-Key: b\r\n", "Idempotency-Key: got 2 headers"),
    )
    for extra, text in cases:
        with server.connect() as s:
            s.sendall(("POST /v1/estimate HTTP/1.1\r\nHost: localhost\r\n" + extra + "\r\n").encode() + b"GET /v2 HTTP/1.1\r\nHost: a\r\n\r\n")
            try:
                response = harness.read_response(s)
            except ConnectionResetError:
                continue
            assert response.status == 400, (extra, response.status)
            if response.headers["content-type"] == "application/json":
                expect_error(response, 400, "invalid_argument", text)
            try:
                rest = s.recv(65536)
            except ConnectionResetError:
                rest = b""
            assert b"binary_tensor_data" not in rest, "the smuggled request was answered: " + extra
    assert server.metric("gnpd_rejected_total{reason=\"framing\"}") - before == len(cases)


def test_headers_in_every_lawful_shape(server):
    """Empty values, blanks around values, cookies, empty lines before the first, a byte at a time, and as long as may be."""
    for lines in (b"X-Empty:\r\n", b"X-Blank: \r\nX-Blanks:   b  \r\n", b"Cookie: a=b; c=d\r\n", b"X-Long: " + b"y" * 60_000 + b"\r\n", b"X-A: b\r\n" * 500):
        with server.connect() as s:
            s.sendall(b"\r\nGET /v2/health/live?a=%20+b HTTP/1.1\r\nHost: localhost\r\n" + lines + b"\r\n")
            assert harness.read_response(s).status == 200, lines[:40]
            for byte in b"GET /v2/health/live HTTP/1.1\r\nHost: localhost\r\n" + lines[:200] + (b"" if len(lines) <= 200 else b"\r\n") + b"\r\n":
                s.sendall(bytes([byte]))
            assert harness.read_response(s).status == 200, lines[:40]


def test_queries_of_many_parameters(server):
    """The library left a query unanswered whose parameters its memory did not hold."""
    for count in (65, 3000):
        with server.connect(5) as s:
            s.sendall(b"GET /v2/health/live?" + b"&".join([b"a=1"] * count) + b" HTTP/1.1\r\nHost: localhost\r\n\r\n")
            expect_error(harness.read_response(s), 400, "invalid_argument", "query: got %d parameters, need at most 64" % count)
    assert server.get("/v2/health/live?" + "&".join("a%d=1" % i for i in range(64))).status == 200


def test_what_the_library_refuses_is_no_cancelled_request(server):
    with server.connect() as s:
        s.sendall(b"GET /what-is-refused HTTP/1.1\r\n\r\n")
        assert harness.read_response(s).status == 400
    harness.eventually(lambda: "\"/what-is-refused\" 400 invalid_argument" in server.log(), what="the log line")
    for start in (b"", b"5\r\nabcde\r\n"):
        before = server.metric("gnpd_rejected_total{reason=\"framing\"}")
        with server.connect() as s:
            s.sendall(b"POST /v1/estimate HTTP/1.1\r\nHost: localhost\r\nTransfer-Encoding: chunked\r\nX-Request-Id: chunk-%d\r\n\r\n" % len(start) + start + b"zz\r\n")
            assert harness.read_response(s).status == 400
        harness.eventually(lambda: re.search(" 400 invalid_argument .* id=\"chunk-%d\"" % len(start), server.log()), what="the log line")
        assert server.metric("gnpd_rejected_total{reason=\"framing\"}") == before + 1


def test_garbage_does_no_harm(server):
    for data in (b"\x00" * 1000, b"\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03", b"GET\r\n\r\n", b"GET / HTTP/9.9\r\n\r\n", b"\r\n" * 5000,
                 b"GET /v2 HTTP/1.1\r\n\r\n", b"A" * 300_000, b"GET / HTTP/1.1\r\n" + b"X: y\r\n" * 60_000 + b"\r\n",
                 b"POST /v1/estimate HTTP/1.1\r\nHost: localhost\r\nTransfer-Encoding: chunked\r\n\r\nzz\r\n",
                 b"POST /v1/estimate HTTP/1.1\r\nHost: localhost\r\nTransfer-Encoding: chunked\r\n\r\nffffffffffffffffff\r\nx",
                 b"POST /v1/estimate HTTP/1.1\r\nHost: localhost\r\nContent-Length: 99999999999999999999999\r\n\r\n",
                 b"POST /v1/estimate HTTP/1.1\r\nHost: localhost\r\nContent-Length: -1\r\n\r\n", b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n"):
        with server.connect(5) as s:
            try:
                s.sendall(data)
                s.shutdown(socket.SHUT_WR)
                while s.recv(65536):
                    pass
            except OSError:
                pass
        assert server.get("/v2/health/live").status == 200


def test_half_sent_requests_are_forgotten(server):
    headers, body = harness.points_body(SMALL)
    request = harness.make_request("POST", ESTIMATE, body, headers)
    for end in (1, 20, 60, len(request) - len(body), len(request) - 5):
        with server.connect() as s:
            s.sendall(request[:end])
    server.wait_metric("gnpd_queue_bytes", 0)
    server.wait_metric("gnpd_connections", 1)


class Dribbler(threading.Thread):
    """Keeps connections that send one byte a second; counts how they end."""

    def __init__(self, server, starts):
        super().__init__()
        self.answers, self.closed, self.sockets = [], 0, []
        for start in starts:
            s = server.connect()
            s.sendall(start)
            self.sockets.append(s)
        self.halt = False

    def run(self):
        selector = selectors.DefaultSelector()
        for s in self.sockets:
            s.setblocking(False)
            selector.register(s, selectors.EVENT_READ)
        sent = time.monotonic()
        while selector.get_map() and not self.halt:
            for key, _ in selector.select(0.05):
                try:
                    data = key.fileobj.recv(65536)
                except ConnectionError:
                    data = b""
                if data:
                    self.answers.append(data)
                    continue
                self.closed += 1
                selector.unregister(key.fileobj)
                key.fileobj.close()
            if time.monotonic() - sent >= 1:
                sent = time.monotonic()
                for key in list(selector.get_map().values()):
                    try:
                        key.fileobj.send(b"x")
                    except OSError:
                        pass


def test_two_hundred_slow_connections():
    slow_header = b"GET /v2 HTTP/1.1\r\nHost: localhost\r\nX-Slow: "
    slow_body = b"POST /v1/estimate HTTP/1.1\r\nHost: localhost\r\nContent-Length: 100000\r\n\r\n"
    with harness.Server(header_seconds=2, body_grace_seconds=1.5, min_body_rate=1000) as server:
        dribbler = Dribbler(server, [slow_header] * 80 + [slow_body] * 100 + [b"P"] * 20)
        dribbler.start()
        try:
            headers, body = harness.points_body(SMALL)
            until, worst, slowest = time.monotonic() + 1.2, 0.0, 0.0
            while time.monotonic() < until:
                worst = max(worst, worst_health(server, 3))
                started = time.monotonic()
                assert server.post(ESTIMATE, body, headers).status == 200
                slowest = max(slowest, time.monotonic() - started)
                assert SLOW > 1 or server.metric("gnpd_connections") >= 200
            assert worst < HEALTH_LIMIT, "health took %.3f s" % worst
            assert slowest < 0.5 * SLOW, "an estimate took %.3f s" % slowest
            harness.eventually(lambda: dribbler.closed == 200, 6, "the end of all slow connections")
        finally:
            dribbler.halt = True
            dribbler.join()
        answers = [a for a in dribbler.answers if a.startswith(b"HTTP/1.1 408 ")]
        assert len(answers) == 180, "%d got an answer" % len(answers)
        assert all(b"\"code\": \"client_timeout\"" in a or b"\"code\":\"client_timeout\"" in a for a in answers)
        assert server.metric("gnpd_rejected_total{reason=\"slow_headers\"}") == 100
        assert server.metric("gnpd_rejected_total{reason=\"slow_body\"}") == 100
        server.wait_metric("gnpd_connections", 1)
        assert server.metric("gnpd_queue_bytes") == 0


def ask_for_much(server):
    """A connection to which more is written than its buffers hold."""
    headers, body = harness.points_body(harness.sphere(150_000 if SLOW == 1 else 60_000), estimator="gmls", quantities="normals,frame,metric,shape_operator")
    s = socket.socket()
    s.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
    s.settimeout(60 * SLOW)
    s.connect(("127.0.0.1", server.port))
    s.sendall(harness.make_request("POST", ESTIMATE, body, headers))
    assert s.recv(1000).startswith(b"HTTP/1.1 200 ")
    return s


def test_answers_that_are_not_taken_are_no_success():
    with harness.Server(reply_seconds=1) as server:
        with ask_for_much(server):
            harness.eventually(lambda: " 408 client_timeout " in server.log(), 10 * SLOW, "the log line of the answer that was not taken")
        assert server.metric("gnpd_rejected_total{reason=\"slow_reply\"}") == 1
        ask_for_much(server).close()
        harness.eventually(lambda: " 499 cancelled " in server.log(), 10 * SLOW, "the log line of the client that went")
        assert server.metric("gnpd_requests_total{operation=\"estimate\",code=\"200\"}") == 0
        assert server.metric("gnpd_requests_total{operation=\"estimate\",code=\"408\"}") == 1


def test_idle_connections_end():
    with harness.Server(idle_seconds=0.3) as server:
        with server.connect() as s:
            assert server.get("/v2", connection=s).status == 200
            assert s.recv(100) == b""


def test_full_queue_and_health():
    with harness.Server(workers=2, runners=1, queue_count=2) as server:
        held = [send_long(server)]
        server.wait_metric("gnpd_running_requests", 1, 20)
        held += [send_long(server), send_long(server)]
        server.wait_metric("gnpd_queue_requests", 2, 20)
        headers, body = harness.points_body(SMALL)
        with server.connect() as s:
            for _ in range(5):
                response = server.post(ESTIMATE, body, headers, connection=s)
                expect_error(response, 503, "overloaded", "queue: 2 requests wait, at most 2 may (queue-count)")
        worst = worst_health(server, 60)
        assert server.metric("gnpd_queue_requests") == 2, "the queue was not full to the end"
        assert worst < HEALTH_LIMIT, "health took %.3f s while the queue was full" % worst
        assert server.metric("gnpd_rejected_total{reason=\"queue_count\"}") == 5
        for s in held:
            s.close()
        server.wait_metric("gnpd_running_requests", 0)
        server.wait_metric("gnpd_queue_requests", 0)
        server.wait_metric("gnpd_cancelled_total{reason=\"client_gone\"}", 3)
        assert server.post(ESTIMATE, body, headers).status == 200


def test_bytes_bound_the_queue():
    with harness.Server(queue_bytes=200_000, discard_bytes="16M") as server:
        expect_error(server.post("/v1/estimate", harness.ply(harness.sphere(100_000))), 413, "too_large", "queue-bytes")
        with server.connect() as s:
            s.sendall(harness.make_request("POST", "/v1/estimate", b"x" * 150_000, {"Content-Length": 160_000}))
            harness.eventually(lambda: server.metric("gnpd_queue_bytes") >= 150_000)
            response = server.post("/v1/estimate", b"y" * 60_000)
            expect_error(response, 503, "overloaded", "queue: requests hold", "at most 200000 may be held (queue-bytes)")
        server.wait_metric("gnpd_queue_bytes", 0)
        assert server.metric("gnpd_rejected_total{reason=\"queue_bytes\"}") >= 2


def test_small_requests_pass_large_ones():
    with harness.Server(workers=2) as server:
        with send_long(server) as s:
            server.wait_metric("gnpd_running_requests", 1, 20)
            headers, body = harness.points_body(SMALL)
            started = time.monotonic()
            assert server.post(ESTIMATE, body, headers).status == 200
            spent = time.monotonic() - started
            assert server.metric("gnpd_running_requests") >= 1, "the large one is over already"
            assert spent < 0.5 * SLOW, "a small request took %.3f s" % spent
            s.close()


def test_work_of_a_vanished_client_stops():
    with harness.Server(workers=2, runners=2) as server:
        other = send_long(server)
        gone = send_long(server)
        server.wait_metric("gnpd_running_requests", 2, 20)
        gone.close()
        server.wait_metric("gnpd_cancelled_total{reason=\"client_gone\"}", 1, 2)
        server.wait_metric("gnpd_running_requests", 1, 2)
        response = harness.read_response(other)
        assert response.status == 200, "one client's end hit another's work: " + response.text[:200]
        other.close()
        harness.eventually(lambda: " 499 cancelled " in server.log(), what="the log line of the cancelled request")
        server.wait_metric("gnpd_queue_bytes", 0)


def test_work_over_its_time_limit_stops():
    with harness.Server(workers=1, work_seconds=0.3) as server:
        with send_long(server) as s:
            expect_error(harness.read_response(s), 504, "deadline_exceeded", "time: not done after 0.", "need it in 0.3 s (work-seconds)")
            assert server.get("/v2", connection=s).status == 200
        assert server.metric("gnpd_cancelled_total{reason=\"deadline\"}") == 1


def test_clients_that_come_and_go():
    headers, body = harness.points_body(harness.sphere(5000))
    request = harness.make_request("POST", ESTIMATE, body, headers)
    with harness.Server(workers=2, queue_count=200) as server:
        for i in range(60):
            s = server.connect()
            s.sendall(request)
            if i % 3:
                time.sleep(0.002 * (i % 7))
            s.close()
        server.wait_metric("gnpd_running_requests", 0, 20)
        server.wait_metric("gnpd_queue_bytes", 0)
        server.wait_metric("gnpd_connections", 1)


def test_many_clients_side_by_side():
    """Suspended connections must not starve the others of their thread."""
    headers, body = harness.points_body(SMALL)
    faults = []

    def client(server):
        try:
            with server.connect() as s:
                for _ in range(10):
                    assert server.post(ESTIMATE, body, headers, connection=s).status == 200
        except Exception as fault:
            faults.append(fault)
    with harness.Server() as server:
        threads = [threading.Thread(target=client, args=(server,)) for _ in range(20)]
        for t in threads:
            t.start()
        for t in threads:
            t.join()
        assert not faults, faults[0]
        server.wait_metric("gnpd_requests_total{operation=\"estimate\",code=\"200\"}", 200)


def test_drain_lets_work_finish():
    with harness.Server(workers=2, drain_seconds=60) as server:
        late, health = server.connect(), server.connect()
        with send_long(server) as s:
            server.wait_metric("gnpd_running_requests", 1, 20)
            server.signal()
            harness.eventually(lambda: server.get("/v2/health/ready").status == 503, 1, "not ready")
            last = server.get("/v2/health/ready", connection=health)
            expect_error(last, 503, "draining")
            assert last.headers["connection"] == "close" and health.recv(1) == b""
            assert server.get("/v2/health/live").status == 200
            headers, body = harness.points_body(SMALL)
            expect_error(server.post(ESTIMATE, body, headers, connection=late), 503, "draining")
            assert harness.read_response(s).status == 200
        assert server.wait(5) == 0


def test_second_signal_cancels():
    with harness.Server(workers=1, runners=1) as server:
        with send_long(server) as s, send_long(server) as waiting:
            server.wait_metric("gnpd_running_requests", 1, 20)
            server.wait_metric("gnpd_queue_requests", 1, 20)
            server.signal()
            harness.eventually(lambda: server.get("/v2/health/ready").status == 503)
            server.signal(signal.SIGINT)
            started = time.monotonic()
            expect_error(harness.read_response(s), 503, "draining")
            expect_error(harness.read_response(waiting), 503, "draining")
            assert server.wait(3) == 0
            assert time.monotonic() - started < 3 * SLOW


def test_drain_time_is_bounded():
    with harness.Server(workers=1, drain_seconds=0.2) as server:
        with send_long(server) as s:
            server.wait_metric("gnpd_running_requests", 1, 20)
            server.signal()
            expect_error(harness.read_response(s), 503, "draining")
        assert server.wait(3) == 0


def test_the_end_while_the_desk_is_asked():
    """What had come to the disk queue when the sockets' threads ended was answered on connections that were gone."""
    request = harness.make_request("DELETE", "/v1/jobs/000000000000000000000000000000")

    def ask(server, over):
        while not over.is_set():
            try:
                with server.connect(5) as s:
                    while not over.is_set():
                        s.sendall(request)
                        harness.read_response(s)
            except (OSError, AssertionError):
                time.sleep(0.001)
    for _ in range(4):
        over = threading.Event()
        with harness.Server(access_log="false", drain_seconds=0, http_threads=4) as server:
            clients = [threading.Thread(target=ask, args=(server, over)) for _ in range(3)]
            for client in clients:
                client.start()
            time.sleep(0.15)
            server.signal()
            code = server.wait(10)
            over.set()
            for client in clients:
                client.join()
            assert code == 0, "the daemon ended with %d" % code


def test_hangup_signal_is_survived(server):
    server.signal(signal.SIGHUP)
    harness.eventually(lambda: "SIGHUP" in server.log(), what="the log line")
    assert server.get("/v2/health/ready").status == 200


def test_log_nobody_reads():
    """The log was written in a way that waits: with its pipe full the daemon answered nobody and ignored SIGTERM."""
    reading, writing = os.pipe()
    with harness.Server(log_to=writing) as server:
        os.close(writing)
        with server.connect() as s:
            for _ in range(1500):
                assert server.get("/v2/health/live", connection=s).status == 200
        full = os.read(reading, 1 << 20)
        assert len(full) > 30000 and full.endswith(b"\n"), len(full)
        assert server.get("/v2").status == 200
        harness.eventually(lambda: b" log lines were dropped: nobody read them\n" in os.read(reading, 1 << 16))
    os.close(reading)


def test_configuration_from_the_command_line():
    def gnpd(*flags, **environment):
        return subprocess.run([harness.BINARY, *flags], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
                              env=dict({"PATH": "/usr/bin"}, **environment), timeout=20)
    assert "--queue-count" in gnpd("--help").stdout
    assert gnpd("--version").stdout.startswith("gnpd ")
    assert gnpd("--check-config").returncode == 0
    assert "queue-count = 7\n" in gnpd("--print-config", GNPD_QUEUE_COUNT="7").stdout
    for flags, text in ((["--nonsense", "1"], "--nonsense: unknown key"), (["--listen", "0.0.0.0:1"], "need a loopback address"),
                        (["--runners", "0"], "--runners: got \"0\", need 1..1024"),
                        (["--weights-dir", "/nonexistent"], "weights-dir: /nonexistent"), (["--config", "/nonexistent"], "/nonexistent")):
        done = gnpd(*flags)
        assert done.returncode == 1 and text in done.stderr, done.stderr


def test_latency_of_small_requests():
    """2,000 points of least squares by JSON+binary on one connection; 25 ms is the product's bound, the printed figure its measure."""
    headers, body = harness.points_body(harness.sphere(2000), estimator="gmls")
    request = harness.make_request("POST", ESTIMATE, body, headers)
    with harness.Server(access_log="false") as server:
        with server.connect() as s:
            times = []
            for _ in range(40):
                started = time.monotonic()
                s.sendall(request)
                assert harness.read_response(s).status == 200
                times.append(time.monotonic() - started)
        median = sorted(times)[len(times) // 2]
        print("2,000 points over keep-alive, JSON+binary: median %.2f ms" % (1e3 * median))
        assert median < 0.025 * SLOW, "median %.1f ms" % (1e3 * median)
