"""Starts the real daemon on a free port in a temporary folder, talks to it over plain sockets, makes clouds."""
import array
import json
import math
import os
import resource
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import time

BINARY = os.path.abspath(os.environ.get("GNPD", "build/gnpd"))


def _slowdown():
    """How much longer things may take than in a plain build: the sanitizers' price."""
    with open(BINARY, "rb") as file:
        data = file.read()
    return 8 if b"__tsan_init" in data else 5 if b"__asan_init" in data else 1


SLOW = _slowdown()


class Skipped(Exception):
    """A test needs a program that is not here: its name."""


class Server:
    """One daemon. Flags are keyword arguments: Server(queue_count=2) passes --queue-count=2. log_to: a file descriptor
    instead of the log's file. weights: {file name: bytes} of its folder of weights; without, those of small_weights().
    program: another gnpd than $GNPD's. wrap: words before the program; environment: more of it; pass_fds: descriptors it inherits. limits: as for
    resource.setrlimit, {resource: (soft, hard)}."""

    def __init__(self, log_to=None, weights=None, program=BINARY, wrap=(), environment=None, pass_fds=(), limits=None, **flags):
        self.folder = tempfile.mkdtemp(prefix="gnpd-e2e.")
        port_file = os.path.join(self.folder, "port")
        self.weights_folder = os.path.join(self.folder, "weights")
        os.mkdir(self.weights_folder)
        for name, content in (small_weights() if weights is None else weights).items():
            self.put_weights(name, content)
        self.log_path = os.path.join(self.folder, "log")
        command = [program, "--listen", "127.0.0.1:0", "--port-file", port_file, "--weights-dir", self.weights_folder]
        command += ["--%s=%s" % (key.replace("_", "-"), value) for key, value in flags.items()]
        environment = dict({k: v for k, v in os.environ.items() if not k.startswith("GNPD_")}, **(environment or {}))
        environment.setdefault("TSAN_OPTIONS", "suppressions=" + os.path.join(os.path.dirname(os.path.abspath(__file__)),
                                                                              "tsan.supp"))
        with open(self.log_path, "wb") as log:
            self.process = subprocess.Popen([*wrap, *command], pass_fds=pass_fds, stderr=log if log_to is None else log_to, stdout=log,
                                            env=environment, cwd=self.folder,
                                            preexec_fn=limits and (lambda: [resource.setrlimit(*item) for item in limits.items()]))
        until = time.monotonic() + 10 * SLOW
        while not os.path.exists(port_file):
            if self.process.poll() is not None or time.monotonic() > until:
                log = self.log()
                self.kill()
                raise AssertionError("the daemon did not start: " + log)
            time.sleep(0.01)
        with open(port_file) as file:
            self.port = int(file.read())

    def __enter__(self):
        return self

    def __exit__(self, kind, value, trace):
        if kind:
            sys.stdout.write(self.log()[-3000:])
            self.kill()
        else:
            self.stop()

    def put_weights(self, name, content):
        """As `gnp-train` does: beside, then renamed."""
        path = os.path.join(self.weights_folder, name)
        with open(path + ".new", "wb") as file:
            file.write(content)
        os.rename(path + ".new", path)

    def log(self):
        with open(self.log_path, errors="replace") as file:
            return file.read()

    def signal(self, number=signal.SIGTERM):
        self.process.send_signal(number)

    def wait(self, seconds):
        return self.process.wait(seconds * SLOW)

    def kill(self):
        if self.process.poll() is None:
            self.process.kill()
            self.process.wait()
        shutil.rmtree(self.folder, ignore_errors=True)

    def stop(self):
        """SIGTERM; the exit status must be 0 and no sanitizer may have spoken."""
        try:
            if self.process.poll() is None:
                self.signal()
            code = self.wait(10)
            log = self.log()
            assert code == 0, "exit status %d\n%s" % (code, log[-6000:])
            assert "Sanitizer" not in log and "runtime error" not in log, log[-6000:]
        finally:
            self.kill()

    def connect(self, timeout=20):
        s = socket.create_connection(("127.0.0.1", self.port), timeout=timeout * SLOW)
        s.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        return s

    def request(self, method, path, body=None, headers=None, connection=None):
        """One exchange; a fresh connection unless one is given."""
        s = connection or self.connect()
        try:
            s.sendall(make_request(method, path, body, headers))
            return read_response(s, method)
        finally:
            if connection is None:
                s.close()

    def get(self, path, **arguments):
        return self.request("GET", path, **arguments)

    def post(self, path, body=b"", headers=None, **arguments):
        return self.request("POST", path, body, headers, **arguments)

    def raw(self, data):
        """Sends bytes as they are and reads one response."""
        with self.connect() as s:
            s.sendall(data)
            return read_response(s, "POST")

    def metric(self, name):
        """The value of one sample, labels included in the name."""
        for line in self.get("/metrics").text.splitlines():
            if line.startswith(name + " "):
                return float(line.rsplit(" ", 1)[1])
        raise AssertionError("no metric " + name)

    def wait_metric(self, name, value, seconds=5):
        until = time.monotonic() + seconds * SLOW
        while self.metric(name) != value:
            assert time.monotonic() < until, "%s: got %g, want %g" % (name, self.metric(name), value)
            time.sleep(0.01)


class Response:
    def __init__(self, status, headers, body, closed):
        self.status, self.headers, self.body, self.closed = status, headers, body, closed

    @property
    def text(self):
        return self.body.decode("utf-8", "replace")

    @property
    def json(self):
        return json.loads(self.body)


def make_request(method, path, body=None, headers=None):
    lines = ["%s %s HTTP/1.1" % (method, path), "Host: localhost"]
    headers = dict(headers or {})
    if body is not None and not any(k.lower() in ("content-length", "transfer-encoding") for k in headers):
        headers["Content-Length"] = len(body)
    lines += ["%s: %s" % item for item in headers.items()]
    return "\r\n".join(lines).encode() + b"\r\n\r\n" + (body or b"")


def read_response(s, method="GET"):
    data = b""
    while b"\r\n\r\n" not in data:
        part = s.recv(65536)
        if not part:
            raise ConnectionError("closed after %d bytes of headers: %r" % (len(data), data[:200]))
        data += part
    head, body = data.split(b"\r\n\r\n", 1)
    lines = head.decode("latin-1").split("\r\n")
    status = int(lines[0].split()[1])
    headers = {k.strip().lower(): v.strip() for k, v in (line.split(":", 1) for line in lines[1:])}
    if status == 100:
        rest = Prefixed(s, body)
        return read_response(rest, method)
    length = 0 if method == "HEAD" else int(headers.get("content-length", 0))
    parts, have = [body], len(body)
    while have < length:
        part = s.recv(1 << 20)
        if not part:
            raise ConnectionError("closed after %d of %d bytes" % (have, length))
        parts.append(part)
        have += len(part)
    return Response(status, headers, b"".join(parts), headers.get("connection", "").lower() == "close")


class Prefixed:
    """A socket whose first bytes were read already."""

    def __init__(self, s, data):
        self.s, self.data = s, data

    def recv(self, count):
        if self.data:
            data, self.data = self.data, b""
            return data
        return self.s.recv(count)


def expect_error(response, status, code, *texts):
    """The error contract: status, JSON body with error, code and request_id, the id echoed in the header."""
    assert response.status == status, "got %d, want %d: %s" % (response.status, status, response.text[:300])
    body = response.json
    assert isinstance(body["error"], str) and body["code"] == code, body
    assert body["request_id"] == response.headers["x-request-id"], (body, response.headers)
    assert response.headers["content-type"] == "application/json", response.headers
    for text in texts:
        assert text in body["error"], "want \"%s\" in \"%s\"" % (text, body["error"])
    if status == 503 and code == "unavailable":
        assert "retry-after" not in response.headers, "asking again does not help"
    elif status == 503:
        assert int(response.headers["retry-after"]) >= 1


def eventually(condition, seconds=5, what="condition"):
    until = time.monotonic() + seconds * SLOW
    while not condition():
        assert time.monotonic() < until, what + " did not come true"
        time.sleep(0.01)


# ---- weights ----

def edge_tensors(width=8, channels=2, neurons=5, layers=2, outputs=16, head_width=6):
    """Names and shapes of a small network of the paper's form."""
    def linear(name, rows, columns):
        return [(name + ".weight", [rows, columns]), (name + ".bias", [rows])]
    block = width // channels
    tensors = linear("model.lift", width, 3)
    for i in range(layers):
        tensors += linear("model.convs.%d.nn.layers.0" % i, neurons, 6)
        tensors += linear("model.convs.%d.nn.layers.1" % i, channels * block * block, neurons)
        tensors += linear("model.mixes.%d" % i, width, width)
    tensors += linear("model.proj", width, width)
    return tensors + linear("mlp.0", head_width, width) + linear("mlp.2", outputs, head_width)


def safetensors(tensors, metadata, scale=0.01):
    """The bytes of a file of weights: (name, shape) of tensors, whose values are small and differ with scale."""
    header, offset = {"__metadata__": metadata}, 0
    values = array.array("f")
    for name, shape in tensors:
        count = math.prod(shape)
        header[name] = {"dtype": "F32", "shape": shape, "data_offsets": [offset, offset + 4 * count]}
        values.extend(scale * math.sin(i + offset) for i in range(count))
        offset += 4 * count
    text = json.dumps(header).encode()
    return len(text).to_bytes(8, "little") + text + values.tobytes()


def edge_weights(scale=0.01, **metadata):
    """A small network that loads; metadata: keys to replace."""
    keys = {"gnp_format": "1", "trunk": "edge", "head": "pooled", "features": "3", "width": "8", "channels": "2", "neurons": "5",
            "layers": "2", "quadrature": "4", "head_width": "6", "outputs": "16", "k": "30", "buffer": "1.25", "height_scale": "2",
            "delta0": "0.005", "regime": "clean"}
    return safetensors(edge_tensors(), dict(keys, **metadata), scale)


def small_weights():
    """Small models under the names of those of a regime, whose answers are no geometry but have its form, and the shipped model for every cloud."""
    kinds = {"fit_clean_30k": ("30", "clean"), "fit_clean_50k": ("50", "clean"), "fit_outlier_50k": ("50", "outlier"), "fit_noise_70k": ("70", "noise")}
    files = {name + ".safetensors": edge_weights(k=k, regime=regime) for name, (k, regime) in kinds.items()}
    return dict(files, **{"any.safetensors": shipped_weights("any")})


def shipped_weights(name):
    with open(os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "weights", name + ".safetensors"), "rb") as file:
        return file.read()


# ---- clouds ----

def sphere(count, radius=1.0):
    """Points of a Fibonacci sphere as a flat array of floats."""
    points = array.array("f", bytes(12 * count))
    turn = math.pi * (3 - math.sqrt(5))
    for i in range(count):
        z = 1 - (2 * i + 1) / count
        r = radius * math.sqrt(1 - z * z)
        points[3 * i] = r * math.cos(turn * i)
        points[3 * i + 1] = r * math.sin(turn * i)
        points[3 * i + 2] = radius * z
    return points


def floats(values):
    return array.array("f", values)


def ply(points, count=None):
    """Binary little-endian PLY; count: what the header claims."""
    head = ("ply\nformat binary_little_endian 1.0\nelement vertex %d\nproperty float x\nproperty float y\nproperty float z\n"
            "end_header\n" % (len(points) // 3 if count is None else count))
    return head.encode() + points.tobytes()


def parse_ply(data):
    """(names, rows as lists of columns) of a binary little-endian PLY of float, double, uchar or int properties."""
    head, body = data.split(b"end_header\n", 1)
    count, names, kinds = 0, [], []
    for line in head.decode().splitlines():
        words = line.split()
        if words[:2] == ["element", "vertex"]:
            count = int(words[2])
        elif words[0] == "property":
            names.append(words[2])
            kinds.append({"float": ("f", 4), "double": ("d", 8), "float32": ("f", 4), "float64": ("d", 8), "uchar": ("B", 1),
                          "int": ("i", 4)}[words[1]])
    size = sum(kind[1] for kind in kinds)
    assert len(body) == count * size, "PLY: %d bytes for %d rows of %d" % (len(body), count, size)
    import struct
    rows = list(struct.iter_unpack("<" + "".join(kind[0] for kind in kinds), body))
    return names, rows


def infer_body(inputs, parameters=None, outputs=None):
    """Headers and body of a JSON+binary infer request; inputs: (name, shape, datatype, bytes)."""
    message = {"inputs": [{"name": n, "shape": shape, "datatype": kind, "parameters": {"binary_data_size": len(data)}}
                          for n, shape, kind, data in inputs]}
    message["parameters"] = dict(parameters or {}, binary_data_output=True)
    if outputs:
        message["outputs"] = outputs
    head = json.dumps(message).encode()
    return {"Inference-Header-Content-Length": len(head)}, head + b"".join(data for _, _, _, data in inputs)


def points_body(points, **parameters):
    return infer_body([("points", [len(points) // 3, 3], "FP32", points.tobytes())], parameters)


def parse_infer(response):
    """The JSON, and name -> array of numbers, of a JSON+binary response."""
    types = {"FP32": "f", "FP64": "d", "BOOL": "B", "INT64": "q"}
    length = int(response.headers["inference-header-content-length"])
    head, rest, result = json.loads(response.body[:length]), response.body[length:], {}
    for output in head["outputs"]:
        size = output["parameters"]["binary_data_size"]
        result[output["name"]] = array.array(types[output["datatype"]], rest[:size])
        rest = rest[size:]
    assert not rest
    return head, result
