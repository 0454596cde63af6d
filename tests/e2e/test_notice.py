"""The end as load balancers see it: not ready first, served as ever for drain-notice-seconds, and no connection reset."""
import os
import shutil
import subprocess
import tempfile
import threading
import time

import harness
from harness import Server, eventually
from test_jobs import CLOUD, QUICK

NOTICE = 1.5


class Clients:
    """Connections that are kept alive as long as the answers say so, under load until they are told to stop."""

    def __init__(self, port, count=4):
        self.port, self.over, self.codes, self.faults = port, False, [], []
        self.threads = [threading.Thread(target=self.ask) for _ in range(count)]
        for thread in self.threads:
            thread.start()

    def ask(self):
        connection = None
        while not self.over:
            try:
                connection = connection or harness.socket.create_connection(("127.0.0.1", self.port), timeout=20 * harness.SLOW)
                connection.sendall(harness.make_request("POST", "/v1/" + QUICK, CLOUD))
                response = harness.read_response(connection)
                self.codes.append(response.status)
                if response.closed:
                    connection.close()
                    connection = None
            except OSError as fault:
                self.faults.append(repr(fault))
                connection = None
        if connection:
            connection.close()

    def stop(self):
        self.over = True
        for thread in self.threads:
            thread.join()
        assert not self.faults and self.codes and set(self.codes) == {200}, (self.faults[:3], len(self.codes), set(self.codes))


def test_clients_see_no_reset_and_no_503_within_the_notice():
    with Server(drain_notice_seconds=NOTICE * harness.SLOW) as server:
        clients = Clients(server.port)
        eventually(lambda: len(clients.codes) > 20, what="load")
        assert server.get("/v2/health/ready").status == 200
        server.signal()
        eventually(lambda: server.get("/v2/health/ready").status == 503, what="not ready")
        assert server.get("/v2/models/estimate/ready").status == 503 and server.get("/v2/health/live").status == 200
        response = server.post("/v1/" + QUICK, CLOUD)
        assert response.status == 200 and response.closed, "the last answer of a connection"
        time.sleep(0.4 * NOTICE)
        clients.stop()


def test_a_second_signal_ends_the_notice():
    with Server(drain_notice_seconds=600) as server:
        server.signal()
        eventually(lambda: server.get("/v2/health/ready").status == 503, what="not ready")
        server.signal()
        assert server.wait(5) == 0


CONFIGURATION = """defaults
  mode http
  timeout connect 5s
  timeout client 60s
  timeout server 60s
frontend front
  bind 127.0.0.1:%d
  default_backend gnpd
backend gnpd
  balance roundrobin
  option httpchk GET /v2/health/ready
  server one 127.0.0.1:%d check inter 100 fall 2 rise 1
  server two 127.0.0.1:%d check inter 100 fall 2 rise 1
"""


def test_haproxy_turns_to_another_within_the_notice():
    """12 of 638 requests were answered 503."""
    if not shutil.which("haproxy"):
        print("skipped: haproxy")
        return
    folder = tempfile.mkdtemp(prefix="gnpd-haproxy.")
    with harness.socket.create_server(("127.0.0.1", 0)) as free:
        port = free.getsockname()[1]
    with Server(drain_notice_seconds=NOTICE * harness.SLOW) as one, Server() as two:
        path = os.path.join(folder, "haproxy.cfg")
        with open(path, "w") as file:
            file.write(CONFIGURATION % (port, one.port, two.port))
        proxy = subprocess.Popen(["haproxy", "-q", "-f", path], stderr=subprocess.DEVNULL)
        try:
            eventually(lambda: harness.socket.socket().connect_ex(("127.0.0.1", port)) == 0, what="HAProxy")
            clients = Clients(port)
            eventually(lambda: len(clients.codes) > 20, what="load")
            one.signal()
            assert one.wait(10) == 0
            done = len(clients.codes)
            eventually(lambda: len(clients.codes) > done + 20, what="load on the other")
            clients.stop()
        finally:
            proxy.terminate()
            proxy.wait()
            shutil.rmtree(folder)
