"""TLS: what is spoken, certificates that change under open connections, and what the daemon says when it may not write plain text."""
import os
import signal
import socket
import ssl
import subprocess
import time

import credentials
import harness
from harness import SLOW, expect_error

ESTIMATE = "/v2/models/estimate/infer"


class Kit:
    def __init__(self, **flags):
        self.folder = credentials.Folder()
        self.folder.__enter__()
        self.certificate, self.key = credentials.certificate(self.folder, "first")
        self.pem, self.private = self.install(self.certificate, self.key)
        self.admin_port = None
        port_file = self.folder.name("admin-port")
        self.server = harness.Server(tls_certificate=self.pem, tls_key=self.private, admin_listen="127.0.0.1:0",
                                     admin_port_file=port_file, **flags)
        self.admin_port = int(self.folder.read("admin-port"))

    def install(self, certificate, key):
        with open(certificate) as one, open(key) as other:
            return self.folder.put("cert.pem", one.read(), 0o644), self.folder.put("key.pem", other.read())

    def __enter__(self):
        return self

    def __exit__(self, *fault):
        self.server.__exit__(*fault)
        self.folder.__exit__()

    def connect(self, *authorities, **arguments):
        return credentials.connect(self.server, *(authorities or (self.certificate,)), **arguments)

    def admin(self, path, method="GET"):
        with socket.create_connection(("127.0.0.1", self.admin_port), 20 * SLOW) as s:
            s.sendall(harness.make_request(method, path))
            return harness.read_response(s, method)

    def metric(self, name):
        for text in self.admin("/metrics").text.splitlines():
            if text.startswith(name + " "):
                return float(text.rsplit(" ", 1)[1])
        raise AssertionError("no metric " + name)

    def reload(self, result):
        name = "gnpd_certificate_reloads_total{result=\"%s\"}" % result
        before = self.metric(name)
        self.server.signal(signal.SIGHUP)
        harness.eventually(lambda: self.metric(name) == before + 1)


def test_requests_over_tls():
    with Kit() as kit:
        headers, body = harness.points_body(harness.sphere(20_000), estimator="gmls", quantities="all", cover="all")
        with kit.connect() as s:
            for _ in range(3):
                response = kit.server.post(ESTIMATE, body, headers, connection=s)
                assert response.status == 200
                message, outputs = harness.parse_infer(response)
                assert max(abs(h + 1) for h in outputs["mean_curvature"]) < 0.05
            assert kit.server.get("/v2/health/live", connection=s).status == 200
            expect_error(kit.server.get("/nothing", connection=s), 404, "not_found")
        assert kit.metric("gnpd_certificate_expiry_timestamp_seconds") > time.time() + 20 * 86400


def test_versions_and_plain_text():
    with Kit() as kit:
        for version in (ssl.TLSVersion.TLSv1_2, ssl.TLSVersion.TLSv1_3):
            with kit.connect(versions=(version, version)) as s:
                assert kit.server.get("/v2/health/live", connection=s).status == 200
                assert s.version() == version.name.replace("_", "."), s.version()
        for options in (["-tls1_1", "-cipher", "ALL:@SECLEVEL=0"], ["-tls1_2", "-cipher", "AES128-SHA256:AES256-SHA:ECDHE-ECDSA-AES128-SHA"]):
            done = subprocess.run(["openssl", "s_client", "-connect", "127.0.0.1:%d" % kit.server.port, *options], stdin=subprocess.DEVNULL,
                                  stdout=subprocess.PIPE, stderr=subprocess.STDOUT, timeout=20 * SLOW)
            assert b"Cipher is (NONE)" in done.stdout, (options, done.stdout[-600:])
        with kit.server.connect() as s:
            s.sendall(b"GET /v2 HTTP/1.1\r\nHost: localhost\r\n\r\n")
            try:
                answer = s.recv(65536)
            except ConnectionResetError:
                answer = b""
            assert not answer.startswith(b"HTTP"), answer
        with kit.connect() as s:
            assert kit.server.get("/v2/health/live", connection=s).status == 200


def test_certificate_changes_under_open_connections():
    with Kit() as kit:
        second = credentials.certificate(kit.folder, "second")
        with kit.connect() as old:
            assert kit.server.get("/v2", connection=old).status == 200
            kit.install(*second)
            kit.reload("ok")
            assert kit.server.get("/v2", connection=old).status == 200, "the open connection ended"
            with kit.connect(second[0]) as new:
                assert kit.server.get("/v2", connection=new).status == 200
            try:
                kit.connect(kit.certificate)
                raise AssertionError("the old certificate is still shown")
            except ssl.SSLCertVerificationError:
                pass
            other = credentials.certificate(kit.folder, "other")
            kit.install(second[0], other[1])
            kit.reload("failed")
            assert "is not the key of the certificate" in kit.server.log()
            assert kit.server.get("/v2", connection=old).status == 200
            with kit.connect(second[0]) as new:
                assert kit.server.get("/v2", connection=new).status == 200


def test_pairs_that_are_no_good():
    def fault(*flags):
        done = subprocess.run([harness.BINARY, "--check-config", *flags], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
                              timeout=20 * SLOW)
        return done.stderr if done.returncode else ""
    with credentials.Folder() as folder:
        (pem, key), (_, other) = credentials.certificate(folder, "a"), credentials.certificate(folder, "b")
        junk = folder.put("junk", "-----BEGIN CERTIFICATE-----\nAAAA\n-----END CERTIFICATE-----\n")
        broken = folder.put("broken", folder.read("a.pem") + "-----BEGIN CERTIFICATE-----\nAAAA\n-----END CERTIFICATE-----\n")
        shared = folder.put("shared", folder.read("a.key"), 0o644)
        assert fault("--tls-certificate", pem, "--tls-key", key) == ""
        for certificate, private, text in ((pem, other, "tls-key: %s: is not the key of the certificate" % other), (junk, key, "tls-certificate: "),
                                           (broken, key, "tls-certificate: "), (pem, junk, "tls-key: "), (pem, shared, "got mode 0644"),
                                           (folder.name("none"), key, "No such file"), (pem, folder.name("none"), "No such file")):
            assert text in fault("--tls-certificate", certificate, "--tls-key", private), (certificate, private, text)
        assert "tls-key: is not given, need it with tls-certificate" in fault("--tls-certificate", pem)
        assert "tls-certificate: is not given, need it with tls-key" in fault("--tls-key", key)


def test_no_plain_text_in_the_stream():
    """The answers that go past the library: in the middle of a body over the session, and none at all from the thread that cuts connections."""
    with Kit(discard_bytes=1000, max_body_bytes=10_000, header_seconds=0.5, body_grace_seconds=0.3, min_body_rate=100_000) as kit:
        with kit.connect() as s:
            s.sendall(b"POST /v1/estimate HTTP/1.1\r\nHost: localhost\r\nTransfer-Encoding: chunked\r\n\r\n" + (b"1000\r\n" + b"x" * 4096 + b"\r\n") * 4)
            response = harness.read_response(s)
            expect_error(response, 413, "too_large") if response.headers.get("x-request-id") else None
            assert response.status == 413 and response.closed
        for start in (b"POST /v1/estimate HTTP/1.1\r\nHost: localhost\r\nContent-Length: 9000\r\n\r\nxx", b"GET /v2 HTTP/1.1\r\nHost: a\r\n", b""):
            with kit.connect() as s:
                s.sendall(start)
                try:
                    assert s.recv(65536) == b"", "an answer where there can be none"
                except (ssl.SSLEOFError, ConnectionResetError):
                    pass
        harness.eventually(lambda: kit.metric("gnpd_connections") == 1)
        assert kit.metric("gnpd_rejected_total{reason=\"slow_body\"}") == 1
        assert kit.metric("gnpd_rejected_total{reason=\"slow_headers\"}") == 2


def test_handshakes_that_go_wrong():
    with Kit(header_seconds=0.5) as kit:
        for data in (b"\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03", b"\x00" * 5000, b"\x16\x03\x01\xff\xff" + b"\x01" * 70_000, b"\x15\x03\x03\x00\x02\x02\x28", b""):
            with kit.server.connect() as s:
                try:
                    s.sendall(data)
                    while s.recv(65536):
                        pass
                except OSError:
                    pass
        harness.eventually(lambda: kit.metric("gnpd_connections") == 1)
        with kit.connect() as s:
            assert kit.server.get("/v2", connection=s).status == 200


def test_clients_over_tls_that_vanish():
    count = 400_000 if SLOW == 1 else 60_000
    headers, body = harness.points_body(harness.sphere(count), estimator="gmls", cover="all")
    request = harness.make_request("POST", ESTIMATE, body, headers)
    with Kit(workers=1) as kit:
        for graceful in (True, False):
            s = kit.connect()
            s.sendall(request)
            harness.eventually(lambda: kit.metric("gnpd_running_requests") == 1, 20)
            if graceful:
                s.settimeout(0.01)
                try:
                    s.unwrap()
                except (OSError, ssl.SSLError):
                    pass
            s.close()
            harness.eventually(lambda: kit.metric("gnpd_running_requests") == 0, 5)
        assert kit.metric("gnpd_cancelled_total{reason=\"client_gone\"}") == 2
        harness.eventually(lambda: kit.metric("gnpd_queue_bytes") == 0)


def test_clients_over_tls():
    """gnp and curl, with a key and the certificate they are told to trust, and without."""
    gnp = os.environ.get("GNP", os.path.join(os.path.dirname(harness.BINARY), "gnp"))
    key = credentials.new_key()
    with credentials.Folder() as keys:
        with Kit(keys_file=keys.put("keys", credentials.line("me", key, "infer", "rate=1/h burst=3"))) as kit:
            url = "https://localhost:%d" % kit.server.port
            with open(kit.folder.name("cloud.ply"), "wb") as file:
                file.write(harness.ply(harness.sphere(600)))

            def estimate(*more, **environment):
                command = [gnp, "estimate", kit.folder.name("cloud.ply"), "--url", url, "--estimator", "gmls", "-o", kit.folder.name("out.ply"), *more]
                environment = dict({k: v for k, v in os.environ.items() if not k.startswith("GNP")}, **environment)
                done = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, timeout=60 * SLOW, env=environment)
                return done.returncode, done.stderr
            trust = ("--cacert", kit.certificate)
            assert estimate(*trust, GNP_KEY=key) == (0, "")
            assert estimate(*trust, "--key", key, GNP_KEY="another") == (0, "")
            code, text = estimate(*trust)
            assert code == 3 and "a key is needed" in text and "HTTP 401" in text, text
            code, text = estimate(*trust, GNP_KEY="unknown")
            assert code == 3 and "the key is not known" in text, text
            code, text = estimate(GNP_KEY=key)
            assert code == 3 and "certificate" in text, text
            code, text = estimate(*trust, GNP_KEY="two words\r\nX: y")
            assert code == 2 and "key: need 1..512 characters without blanks" in text and "two" not in text, text
            done = subprocess.run(["curl", "-sS", "--cacert", kit.certificate, "-H", "X-API-Key: " + key, "--data-binary",
                                   "@" + kit.folder.name("cloud.ply"), url + "/v1/estimate?estimator=gmls"], stdout=subprocess.PIPE, timeout=60 * SLOW)
            names, rows = harness.parse_ply(done.stdout)
            assert len(rows) == 600 and "nx" in names, names
            code, text = estimate(*trust, GNP_KEY=key)
            assert code == 3 and "HTTP 429" in text and "over 0.000277778 requests a second" in text, text
