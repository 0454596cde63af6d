"""gnpd behind nginx and HAProxy, by the configurations that deploy/ ships."""
import contextlib
import os
import shutil
import socket
import subprocess
import tempfile
import time

import harness
from harness import SLOW, Skipped, eventually, expect_error

DEPLOY = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "deploy")
CLOUD = harness.ply(harness.sphere(600))
NAME = "gnp.example.org"
BIG = bytes(64 << 20)


def program(name):
    path = shutil.which(name, path=os.environ.get("PATH", "") + ":/usr/sbin:/usr/local/sbin")
    if not path:
        raise Skipped(name)
    return path


def free_port():
    with socket.create_server(("127.0.0.1", 0)) as s:
        return s.getsockname()[1]


def shipped(name, *changes):
    """The file of deploy/ with what differs from machine to machine; each change must find its line once."""
    with open(os.path.join(DEPLOY, name)) as file:
        text = file.read()
    for before, after in changes:
        assert text.count(before) == 1, (name, before)
        text = text.replace(before, after)
    return text


class Proxy:
    """A proxy at a port of its own; what harness.Server does with requests works here too."""
    connect, request, get, post = harness.Server.connect, harness.Server.request, harness.Server.get, harness.Server.post

    def __init__(self, port, process):
        self.port, self.process = port, process


@contextlib.contextmanager
def running(command, folder, port):
    with open(os.path.join(folder, "log"), "w+") as log:
        process = subprocess.Popen(command, stdout=log, stderr=log)
        try:
            def listens():
                log.seek(0)
                assert process.poll() is None, log.read()
                with socket.socket() as s:
                    return s.connect_ex(("127.0.0.1", port)) == 0
            eventually(listens, 10, "the proxy")
            yield Proxy(port, process)
        finally:
            process.terminate()
            process.wait(10 * SLOW)


@contextlib.contextmanager
def nginx(server, *changes):
    path, port = program("nginx"), free_port()
    with tempfile.TemporaryDirectory(prefix="gnpd-nginx.") as folder:
        os.chmod(folder, 0o711)  # its workers have another user where this one is root
        text = shipped("nginx.conf", ("127.0.0.1:8080", "127.0.0.1:%d" % server.port), ("listen 80;", "listen 127.0.0.1:%d;" % port), *changes)
        with open(os.path.join(folder, "nginx.conf"), "w") as file:
            file.write("pid %s/pid;\nerror_log stderr;\ndaemon off;\nworker_processes 1;\nevents {}\nhttp {\naccess_log off;\n" % folder)
            file.write("".join("%s_temp_path %s/%s;\n" % (kind, folder, kind) for kind in ("client_body", "proxy", "fastcgi", "uwsgi", "scgi")))
            file.write(text + "}\n")
        with running([path, "-p", folder, "-c", os.path.join(folder, "nginx.conf")], folder, port) as proxy:
            yield proxy


@contextlib.contextmanager
def haproxy(server):
    path, port = program("haproxy"), free_port()
    with tempfile.TemporaryDirectory(prefix="gnpd-haproxy.") as folder:
        with open(os.path.join(folder, "haproxy.cfg"), "w") as file:
            file.write(shipped("haproxy.cfg", ("127.0.0.1:8080", "127.0.0.1:%d" % server.port), ("bind :80", "bind 127.0.0.1:%d" % port)))
        with running([path, "-db", "-f", file.name], folder, port) as proxy:
            eventually(lambda: ask(proxy, "GET", "/v2").status == 200, 10, "its check")
            yield proxy


def ask(proxy, method, path, body=None, **headers):
    """One exchange by the public name."""
    data = harness.make_request(method, path, body, {key.replace("_", "-"): value for key, value in headers.items()})
    with proxy.connect() as s:
        try:
            s.sendall(data.replace(b"Host: localhost", b"Host: " + NAME.encode(), 1))
        except (BrokenPipeError, ConnectionResetError):
            pass  # the proxy has its answer and takes no more
        return harness.read_response(s, method)


def check_work(proxy):
    response = ask(proxy, "POST", "/v1/estimate?estimator=gmls", CLOUD)
    assert response.status == 200 and response.body.startswith(b"ply")
    with proxy.connect() as s:
        s.sendall(harness.make_request("GET", "/v2"))
        assert harness.read_response(s).status == 200
    assert ask(proxy, "POST", "/v1/estimate?estimator=gmls", CLOUD, Origin="http://" + NAME).status == 200
    expect_error(ask(proxy, "POST", "/v1/estimate?estimator=gmls", CLOUD, Origin="http://evil.example"), 403, "forbidden")


def check_refusals(proxy, times=5):
    """They came as 502, and good requests after them."""
    for _ in range(times):
        expect_error(ask(proxy, "POST", "/v1/estimate", BIG[:32 << 20]), 413, "too_large", "max-body-bytes")
        expect_error(ask(proxy, "POST", "/nothing", BIG), 404, "not_found")
        expect_error(ask(proxy, "POST", "/v1/estimate", BIG[:8 << 20], Content_Type="multipart/form-data"), 415, "unsupported_media")
        assert ask(proxy, "GET", "/v2/health/ready").status == 200


def check_events(server, proxy):
    """Each as it comes: the first while the job runs."""
    job = server.post("/v1/jobs/flow?estimator=gmls&steps=1000000&dt=1e-9&scheme=explicit", CLOUD).json["id"]
    with proxy.connect(5) as s:
        s.sendall(harness.make_request("GET", "/v1/jobs/%s/events" % job))
        data, began = b"", time.monotonic()
        while data.count(b"event: ") < 3:
            data += s.recv(65536)
        assert time.monotonic() - began < 5 * SLOW
        assert server.get("/v1/jobs/" + job).json["state"] == "running"
        server.request("DELETE", "/v1/jobs/" + job)
        while b"cancelled" not in data:
            data += s.recv(65536)


def gnpd():
    return harness.Server(allowed_hosts=NAME, max_body_bytes="16M")


def test_nginx_as_shipped():
    with gnpd() as server, nginx(server) as proxy:
        check_work(proxy)
        check_refusals(proxy)
        check_events(server, proxy)


def test_nginx_that_buffers():
    """By its defaults: bodies whole before they are sent, answers too."""
    with gnpd() as server:
        with nginx(server, ("proxy_request_buffering off;", ""), ("proxy_buffering off;", ""), ("proxy_next_upstream off;", "")) as proxy:
            check_work(proxy)
            check_refusals(proxy)
            check_events(server, proxy)


def test_haproxy_as_shipped():
    with gnpd() as server, haproxy(server) as proxy:
        check_work(proxy)
        check_refusals(proxy)
        check_events(server, proxy)
