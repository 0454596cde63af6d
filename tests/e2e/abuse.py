"""What clients do to a server, many at once; each form takes its size, so that tests/e2e is short and tests/soak long.

Every function asserts what must hold and leaves the server idle."""
import functools
import os
import random
import resource
import signal
import socket
import threading
import time

import harness
from harness import SLOW

ESTIMATE = "/v2/models/estimate/infer"
HEALTH = harness.make_request("GET", "/v2/health/live")


# ---- what a process holds ----

class Holdings:
    """Descriptors, threads and memory of a daemon at one moment."""

    def __init__(self, server):
        folder = "/proc/%d/" % server.process.pid
        with open(folder + "status") as file:
            fields = dict(line.split(":", 1) for line in file)
        self.threads, self.resident = int(fields["Threads"]), int(fields["VmRSS"].split()[0]) * 1024
        self.files = len(os.listdir(folder + "fd"))

    def __str__(self):
        return "%d files, %d threads, %.1f MB" % (self.files, self.threads, self.resident / 1e6)


def settle(server):
    """Waits until nothing is under way, and says what the daemon holds then."""
    for name in ("gnpd_running_requests", "gnpd_queue_requests", "gnpd_queue_bytes"):
        server.wait_metric(name, 0, 15)
    server.wait_metric("gnpd_connections", 1, 15)
    time.sleep(0.05)
    return Holdings(server)


def check_given_back(server, before, growth=32 << 20):
    """Files and threads are as many as before; memory has grown by no more than that, at the latest when there was nothing to do for a
    while (a sanitizer keeps what was freed)."""
    harness.eventually(lambda: Holdings(server).files <= before.files, 5, "as few files as before")
    after, until = settle(server), time.monotonic() + 15
    while SLOW == 1 and after.resident > before.resident + growth:
        assert time.monotonic() < until, "%s, before %s" % (after, before)
        time.sleep(0.2)
        after = Holdings(server)
    assert after.threads == before.threads, "%s, before %s" % (after, before)
    return after


def spin(count, client):
    """Runs client(i) in so many threads and raises the first fault."""
    faults = []

    def guarded(i):
        try:
            client(i)
        except Exception as fault:
            faults.append(fault)
    threads = [threading.Thread(target=guarded, args=(i,)) for i in range(count)]
    for t in threads:
        t.start()
    for t in threads:
        t.join()
    if faults:
        raise AssertionError("%d of %d clients failed, the first: %r" % (len(faults), count, faults[0])) from faults[0]


# ---- requests and what they are answered ----

@functools.lru_cache(maxsize=None)
def estimate_request(points, **parameters):
    headers, body = harness.points_body(harness.sphere(points), **dict({"estimator": "gmls"}, **parameters))
    return harness.make_request("POST", ESTIMATE, body, headers)


def payload(response):
    """What must be the same each time: not the report, which has seconds in it, nor the request's id."""
    if response.status != 200:
        return response.status, response.json["code"], response.json["error"]
    if "inference-header-content-length" in response.headers:
        _, tensors = harness.parse_infer(response)
        return response.status, {name: values.tobytes() for name, values in tensors.items()}
    if response.body.startswith(b"ply\n"):
        head, rows = response.body.split(b"end_header\n", 1)
        return response.status, [line for line in head.splitlines() if not line.startswith(b"comment")], rows
    if response.headers["content-type"].startswith("text/plain; charset"):
        return response.status, [line for line in response.body.splitlines() if not line.startswith(b"#")]
    return response.status, response.body if b"seconds" not in response.body else len(response.body) > 0


def mixture():
    """Requests of many kinds, good and bad."""
    def post(path, body, **headers):
        return harness.make_request("POST", path, body, {k.replace("_", "-"): v for k, v in headers.items()})
    small, middle = harness.sphere(300), harness.sphere(1500)
    text = "\n".join("%.9g %.9g %.9g" % tuple(small[3 * i:3 * i + 3]) for i in range(300)).encode()
    return [
        estimate_request(1500), estimate_request(300, quantities="all"), estimate_request(600, estimator="adaptive"),
        estimate_request(400, estimator="gnp", weights="fit_clean_30k"),
        post("/v1/estimate?estimator=gmls", harness.ply(middle)),
        post("/v1/estimate?estimator=gmls&format=ply", text, Content_Type="text/plain"),
        post("/v1/filter?estimator=gmls", harness.ply(small)),
        post("/v1/geodesic?estimator=gmls&source=0", harness.ply(small)),
        harness.make_request("GET", "/v2/models/estimate"), harness.make_request("GET", "/v2/health/ready"),
        post("/v1/estimate", b"ply\nnonsense"), post("/v1/estimate?k=nan", harness.ply(small)), post("/v1/nothing", b"x"),
        harness.make_request("PUT", "/v1/estimate", b"x"), post(ESTIMATE, b"{\"inputs\": [}"), post(ESTIMATE, b""),
        post("/v1/estimate", b"\x1f\x8bgarbage", Content_Encoding="gzip"),
    ]


def exchange(s, request):
    s.sendall(request)
    return harness.read_response(s, request.split(b" ", 1)[0].decode())


def mixed_clients(server, clients, seconds):
    """Every answer is the one an idle server gives. Returns how many there were."""
    requests = mixture()
    idle = []
    for request in requests:
        with server.connect() as s:
            idle.append(payload(exchange(s, request)))
    counts = [0] * clients
    until = time.monotonic() + seconds

    def client(number):
        choose = random.Random(number)
        s = server.connect(60)
        while time.monotonic() < until:
            i = choose.randrange(len(requests))
            response = exchange(s, requests[i])
            assert payload(response) == idle[i], "request %d: another answer than on an idle server: %d %s" % (
                i, response.status, response.text[:200])
            counts[number] += 1
            if response.closed or choose.random() < 0.1:
                s.close()
                s = server.connect(60)
        s.close()
    spin(clients, client)
    return sum(counts)


# ---- connections ----

def come_and_go(server, count):
    """Opened and dropped, idle or in the middle of something."""
    request = estimate_request(600)
    starts = (b"", b"G", b"GET /v2 HTTP/1.1\r\nHost: localhost\r\n", request[:200], request[:-10], HEALTH, request)
    for i in range(count):
        s = server.connect()
        s.sendall(starts[i % len(starts)])
        if i % 5 == 0:  # with a reset rather than an end
            s.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, b"\1\0\0\0\0\0\0\0")
        s.close()
        if i % 200 == 0:
            server.get("/v2/health/live")


def slow_readers(server, count, reply_seconds):
    """A large answer is asked for and not read, or a byte a second: it is cut after reply_seconds, and hurts nobody. A sanitizer's smaller
    one may fit the sockets' buffers: the server needs idle-seconds as short."""
    request = estimate_request(30_000 if SLOW == 1 else 8_000, quantities="all")
    readers = []
    for _ in range(count):
        s = socket.socket()
        s.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        s.settimeout(30 * SLOW)
        s.connect(("127.0.0.1", server.port))
        s.sendall(request)
        readers.append(s)
    started = time.monotonic()
    small = estimate_request(300)
    while server.metric("gnpd_connections") > 1:
        if server.metric("gnpd_running_requests") + server.metric("gnpd_queue_requests"):
            started = time.monotonic()  # not all answers are there
        assert time.monotonic() - started < (5 + 2 * reply_seconds) * SLOW, "%d slow readers are still there" % (server.metric("gnpd_connections") - 1)
        with server.connect() as s:
            asked = time.monotonic()
            assert exchange(s, HEALTH).status == 200
            assert time.monotonic() - asked < 0.1 * SLOW, "health took %.3f s beside slow readers" % (time.monotonic() - asked)
            assert exchange(s, small).status in (200, 503)
            if time.monotonic() - asked > 1:  # it waited for others' work
                started = time.monotonic()
        for s in readers[::2]:
            try:
                s.recv(1, socket.MSG_DONTWAIT)
            except OSError:
                pass
        time.sleep(0.05)
    for s in readers:
        s.close()


def vanish(server, count):
    """Clients that leave in the middle of long work, all at once: their work stops and others go on. Returns the seconds it took."""
    request = estimate_request(100_000 if SLOW == 1 else 20_000, cover="all")
    before = server.metric("gnpd_cancelled_total{reason=\"client_gone\"}")
    sockets = []
    for _ in range(count):
        s = server.connect(60)
        s.sendall(request)
        sockets.append(s)
    harness.eventually(lambda: server.metric("gnpd_running_requests") + server.metric("gnpd_queue_requests") >= count, 20,
                       "the work of %d clients" % count)
    left = time.monotonic()
    for s in sockets:
        s.close()
    for name in ("gnpd_running_requests", "gnpd_queue_requests", "gnpd_queue_bytes"):
        server.wait_metric(name, 0, 3)
    spent = time.monotonic() - left
    assert server.metric("gnpd_cancelled_total{reason=\"client_gone\"}") - before >= count - 1
    with server.connect() as s:
        assert exchange(s, estimate_request(300)).status == 200
    return spent


def beside_suspended(server, connections, seconds):
    """Many kept connections of one thread, some suspended on long work: the ready ones are not passed over. Returns the worst
    seconds a health answer took. A later libmicrohttpd mends "ready connections skipped while another is suspended"."""
    long = estimate_request(200_000 if SLOW == 1 else 30_000, cover="all")
    small = estimate_request(120)
    kept = [server.connect(60) for _ in range(connections)]
    for s in kept:
        assert exchange(s, HEALTH).status == 200
    until, worst = time.monotonic() + seconds, 0.0
    while time.monotonic() < until:
        busy = [server.connect(60) for _ in range(3)]
        for s in busy:
            s.sendall(long)
        for s in kept[1::2]:
            s.sendall(HEALTH)
        for s in kept[0::8]:
            s.sendall(small)
        started = time.monotonic()
        for s in kept[1::2]:
            assert harness.read_response(s).status == 200
        worst = max(worst, time.monotonic() - started)
        for s in kept[0::8]:
            response = harness.read_response(s)
            assert response.status == 200, response.text
        for s in busy:
            s.close()
    for s in kept:
        s.close()
    return worst


# ---- overload ----

def throughput(server, request, clients, seconds, refused=(200, 503)):
    """Answers with 200 a second of clients that ask again and again, a refused one after a while; and the number refused."""
    good, bad = [0] * clients, [0] * clients
    start = time.monotonic()
    until = start + seconds

    def client(number):
        with server.connect(60) as s:
            while time.monotonic() < until:
                response = exchange(s, request)
                assert response.status in refused, "%d %s" % (response.status, response.text[:200])
                if response.status == 200:
                    good[number] += 1
                    continue
                assert int(response.headers["retry-after"]) >= 1 and response.json["code"] == "overloaded"
                bad[number] += 1
                time.sleep(0.25)
    spin(clients, client)
    return sum(good) / (time.monotonic() - start), sum(bad)


def overload(server, runners, queue, seconds):
    """Ten times as many clients as there is room for: answers are 200 or 503 with Retry-After, and as many good ones a second as at
    the peak. Returns both rates and how many were refused."""
    request = estimate_request(20_000 if SLOW == 1 else 2_000)
    throughput(server, request, runners, 0.3)
    peak, _ = throughput(server, request, runners + queue // 2, seconds)
    rate, refused = throughput(server, request, 10 * (runners + queue), seconds)
    assert refused > 0, "nobody was refused: no overload"
    return peak, rate, refused


# ---- the end ----

def states():
    """name -> what brings a connection into that state; the socket it returns stays open."""
    small, long = estimate_request(300), estimate_request(300_000 if SLOW == 1 else 40_000, cover="all")
    large = estimate_request(25_000 if SLOW == 1 else 8_000, quantities="all")

    def opened(server, data, until=None):
        s = server.connect(60)
        s.sendall(data)
        if until:
            server.wait_metric(*until)
        return s

    def kept(server):
        s = opened(server, HEALTH)
        harness.read_response(s)
        return s

    def unread(server):
        s = socket.socket()
        s.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        s.connect(("127.0.0.1", server.port))
        s.sendall(large)
        server.wait_metric("gnpd_running_requests", 1, 20)
        server.wait_metric("gnpd_running_requests", 0, 20)
        return s

    def queued(server):
        first = opened(server, long, ("gnpd_running_requests", 1, 20))
        second = opened(server, long, ("gnpd_queue_requests", 1, 20))
        return first, second
    return {
        "idle": lambda server: None,
        "a kept connection": kept,
        "an opened connection": lambda server: opened(server, b""),
        "half of the headers": lambda server: opened(server, small[:40]),
        "half of a body": lambda server: opened(server, small[:-100]),
        "running": lambda server: opened(server, long, ("gnpd_running_requests", 1, 20)),
        "queued": queued,
        "an answer nobody reads": unread,
    }


def end_in(state, drain_seconds):
    """SIGTERM in that state: exit status 0 within drain_seconds and two. Returns the seconds."""
    server = harness.Server(workers=2, runners=1, drain_seconds=drain_seconds)
    try:
        held = states()[state](server)
        asked = time.monotonic()
        server.signal(signal.SIGTERM)
        code = server.process.wait((drain_seconds + 20) * SLOW)
        spent = time.monotonic() - asked
        log = server.log()
        assert code == 0, "exit status %d: %s" % (code, log[-2000:])
        assert "Sanitizer" not in log and "runtime error" not in log, log[-6000:]
        assert spent < drain_seconds + 2 * (1 if SLOW == 1 else 4), "%s, %g s to drain: the end took %.2f s" % (state, drain_seconds, spent)
        del held
        return spent
    finally:
        server.kill()


# ---- signals and files ----

def hangup_storm(server, signals, clients, seconds):
    """SIGHUP again and again under load: every answer as before, the weights loaded again at least once."""
    halt = threading.Event()

    def storm():
        for _ in range(signals):
            server.signal(signal.SIGHUP)
            if halt.wait(seconds / signals):
                return
    thread = threading.Thread(target=storm)
    thread.start()
    try:
        count = mixed_clients(server, clients, seconds)
    finally:
        halt.set()
        thread.join()
    assert server.metric("gnpd_weights_reloads_total{result=\"ok\"}") > 0
    assert server.metric("gnpd_weights_reloads_total{result=\"failed\"}") == 0
    return count


def little_memory(server, room, clients, seconds, points=150_000):
    """The process gets no more than `room` bytes beyond what it has: requests that do not fit are refused or dropped, the daemon
    lives, and with memory there again all is as before. Returns how many were answered 200, 503, and dropped."""
    small, large = estimate_request(300), estimate_request(points)
    with server.connect() as s:
        good = payload(exchange(s, small))
    with open("/proc/%d/statm" % server.process.pid) as file:
        size = int(file.read().split()[0]) * resource.getpagesize()
    was = resource.prlimit(server.process.pid, resource.RLIMIT_AS)
    resource.prlimit(server.process.pid, resource.RLIMIT_AS, (size + room, was[1]))
    counts = {200: 0, 503: 0, "dropped": 0}
    until = time.monotonic() + seconds

    def client(number):
        while time.monotonic() < until:
            try:
                with server.connect(60) as s:
                    response = exchange(s, large if number % 2 else small)
            except ConnectionError:
                counts["dropped"] += 1
                continue
            assert response.status in (200, 503), "%d %s" % (response.status, response.text[:200])
            assert response.status == 503 or number % 2 or payload(response) == good
            counts[response.status] += 1
    spin(clients, client)
    assert server.process.poll() is None, "the daemon died: " + server.log()[-2000:]
    resource.prlimit(server.process.pid, resource.RLIMIT_AS, was)
    with server.connect() as s:
        assert payload(exchange(s, small)) == good
        assert exchange(s, large).status == 200
    return counts


def processor_seconds(server):
    with open("/proc/%d/stat" % server.process.pid) as file:
        fields = file.read().rsplit(")", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def no_more_files(server, more):
    """The process may open no more files: those connected go on, nothing spins, and with files there again all can connect."""
    kept = server.connect()
    assert exchange(kept, HEALTH).status == 200
    was = resource.prlimit(server.process.pid, resource.RLIMIT_NOFILE)
    resource.prlimit(server.process.pid, resource.RLIMIT_NOFILE, (Holdings(server).files + more, was[1]))
    waiting = [socket.create_connection(("127.0.0.1", server.port), 5) for _ in range(more + 20)]
    time.sleep(0.3)
    began, used = time.monotonic(), processor_seconds(server)
    for _ in range(10):
        assert exchange(kept, HEALTH).status == 200
        assert exchange(kept, estimate_request(120)).status == 200
        time.sleep(0.03)
    share = (processor_seconds(server) - used) / (time.monotonic() - began)
    resource.prlimit(server.process.pid, resource.RLIMIT_NOFILE, was)
    for s in waiting:
        s.close()
    with server.connect(10) as s:
        assert exchange(s, HEALTH).status == 200
    kept.close()
    return share
