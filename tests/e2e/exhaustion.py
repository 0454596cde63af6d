"""Memory that runs out: the daemon under failing_malloc.so, and requests of every kind to send it meanwhile."""
import gzip
import io
import json
import mmap
import os
import struct
import tempfile
import time
import zipfile

import harness

LIBRARY = os.path.join(os.path.dirname(harness.BINARY), "tests", "failing_malloc.so")
NEVER = 0
# libzip loses a piece or two when it finds no memory for an archive it writes.
LOSES = {"npz": 2, "npz deflated": 2, "laplacian": 2}


class Failing:
    """The switch that failing_malloc.so shares with the daemon it is loaded into."""

    def __init__(self):
        self.file = tempfile.NamedTemporaryFile(prefix="gnpd-failing.")
        self.file.write(bytes(64))
        self.file.flush()
        self.map = mmap.mmap(self.file.fileno(), 64)

    def environment(self, reserve):
        return {"LD_PRELOAD": LIBRARY, "FAILING_MALLOC": self.file.name, "FAILING_MALLOC_RESERVE": "1" if reserve else "0"}

    def value(self, index):
        return struct.unpack_from("q", self.map, 8 * index)[0]

    def fail(self, first, count=1):
        """Of the allocations from now on, those from number `first` on fail, so many."""
        struct.pack_into("q", self.map, 8, NEVER)
        struct.pack_into("q", self.map, 0, first)
        struct.pack_into("q", self.map, 16, 0)
        struct.pack_into("q", self.map, 8, count)

    def stop(self):
        struct.pack_into("q", self.map, 8, NEVER)

    asked = property(lambda self: self.value(2))
    live = property(lambda self: self.value(3))
    failed = property(lambda self: self.value(4))


def npy(points):
    """A NumPy array (n, 3) of FP32."""
    header = b"{'descr': '<f4', 'fortran_order': False, 'shape': (%d, 3), }" % (len(points) // 3)
    header += b" " * (-(len(header) + 11) % 64) + b"\n"
    return b"\x93NUMPY\x01\x00" + struct.pack("<H", len(header)) + header + points.tobytes()


def npz(points, compression):
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w", compression) as archive:
        archive.writestr("points.npy", npy(points))
    return out.getvalue()


def kinds():
    """name -> the bytes of a request."""
    cloud = harness.sphere(120)
    rows = [tuple(cloud[3 * i:3 * i + 3]) for i in range(120)]
    scalar = harness.floats(row[0] for row in rows).tobytes()

    def v1(path, body, **headers):
        return harness.make_request("POST", "/v1/" + path, body, {k.replace("_", "-"): v for k, v in headers.items()})

    def v2(operation, inputs, parameters, outputs=None):
        headers, body = harness.infer_body(inputs, parameters, outputs)
        return harness.make_request("POST", "/v2/models/%s/infer" % operation, body, headers)

    text = "\n".join("%r %r %r" % row for row in rows).encode()
    pcd = ("VERSION .7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nWIDTH 120\nHEIGHT 1\nPOINTS 120\nDATA binary\n").encode() + cloud.tobytes()
    obj = "\n".join("v %r %r %r" % row for row in rows).encode()
    query = "estimate?estimator=gmls&k=20"
    inline = json.dumps({"id": "a", "inputs": [{"name": "points", "shape": [120, 3], "datatype": "FP64", "data": rows}],
                         "parameters": {"estimator": "gmls", "k": 20}, "outputs": [{"name": "normals"}, {"name": "mean_curvature"}]}).encode()
    binary = ("points", [120, 3], "FP32", cloud.tobytes())
    source = ("source", [120, 1], "FP32", scalar)
    return {
        "ply": v1(query, harness.ply(cloud)),
        "npy": v1(query + "&quantities=normals&format=json", npy(cloud)),
        "npz": v1(query, npz(cloud, zipfile.ZIP_STORED)),
        "npz deflated": v1(query + "&format=npz", npz(cloud, zipfile.ZIP_DEFLATED)),
        "xyz": v1(query, text, Content_Type="text/plain"),
        "pcd": v1(query, pcd),
        "obj": v1(query + "&format=vtk", obj, Content_Type="model/obj"),
        "json file": v1(query, json.dumps({"points": rows}).encode(), Content_Type="application/json"),
        "gzip": v1(query, gzip.compress(harness.ply(cloud)), Content_Encoding="gzip"),
        "v2 json": harness.make_request("POST", "/v2/models/estimate/infer", inline),
        "v2 binary": v2("estimate", [binary], {"estimator": "gmls", "k": 20}),
        "v2 chunked": harness.make_request("POST", "/v1/" + query, b"%x\r\n%s\r\n0\r\n\r\n" % (len(harness.ply(cloud)), harness.ply(cloud)),
                                           {"Transfer-Encoding": "chunked"}),
        "gnp": v1("estimate?weights=fit_clean_30k", harness.ply(cloud)),
        "adaptive": v1("estimate?estimator=adaptive", harness.ply(cloud)),
        "patch": v1("patch?at=7", harness.ply(cloud)),
        "filter": v1("filter?estimator=gmls&project=true", harness.ply(cloud)),
        "flow": v1("flow?estimator=gmls&steps=2", harness.ply(cloud)),
        "smooth": v1("smooth?estimator=gmls", harness.ply(cloud)),
        "poisson": v2("poisson", [binary, source], {"estimator": "gmls"}),
        "laplacian": v1("laplacian?estimator=gmls&format=npz", harness.ply(cloud)),
        "heat": v2("heat", [binary, ("initial", [120, 1], "FP32", scalar)], {"estimator": "gmls"}),
        "geodesic": v1("geodesic?estimator=gmls&source=0", harness.ply(cloud)),
        "spectrum": v1("spectrum?estimator=gmls&count=2&format=ply", harness.ply(cloud)),
        "metrics": harness.make_request("GET", "/metrics"),
        "metadata": harness.make_request("GET", "/v2/models/estimate"),
        "openapi": harness.make_request("GET", "/openapi.yaml"),
        "bad": v1(query, b"nonsense"),
    }


class Sweep:
    """Sends requests to a daemon whose memory runs out, and says what is wrong with how it takes it."""

    def __init__(self, server, failing):
        self.server, self.failing = server, failing
        self.faults, self.sent, self.dropped, self.refused, self.answered = [], 0, 0, 0, 0

    def exchange(self, request):
        with self.server.connect() as s:
            s.sendall(request)
            return harness.read_response(s, request.split(b" ", 1)[0].decode())

    def settled(self, live, seconds=1):
        """Waits for the pieces in use to become as few as before."""
        until = time.monotonic() + seconds
        while self.failing.live > live and time.monotonic() < until:
            time.sleep(0.0005)
        return self.failing.live <= live

    def attempt(self, name, request, number, count, good):
        self.sent += 1
        where = "%s: allocations %d to %d" % (name, number, number + count - 1)
        self.failing.fail(number, count)
        try:
            response = self.exchange(request)
        except (ConnectionError, OSError, IndexError) as fault:
            self.dropped += 1
            if isinstance(fault, TimeoutError):
                self.faults.append(where + ": no answer and no end of the connection")
            return
        finally:
            self.failing.stop()
        if response.status == good.status and response.body == good.body:
            self.answered += 1
        elif response.status == 503 and response.json["code"] == "out_of_memory" and int(response.headers["retry-after"]) > 0:
            self.refused += 1
        elif response.status != good.status:
            if name.startswith("npz") and response.status == 400 and "Not a zip archive" in response.text:
                self.refused += 1  # libzip's words for it
                return
            self.faults.append("%s: %d %s" % (where, response.status, response.text[:200]))
        elif name not in ("metrics",) and not self.same(response, good):
            self.faults.append("%s: another answer than without the failure" % where)

    @staticmethod
    def same(response, good):
        """Alike but for the seconds that reports carry."""
        return len(response.body) > 0.5 * len(good.body) or response.status >= 400

    def run(self, name, request, step, count=1, first=0):
        """Fails `count` allocations at every step-th, from the first on, of those a request asks for. The number of these."""
        for _ in range(3):
            good = self.exchange(request)
            time.sleep(0.002)
        assert good.status == (415 if name == "bad" else 200), "%s: %d %s" % (name, good.status, good.text[:200])
        time.sleep(0.02)
        live = self.failing.live
        self.failing.fail(0, NEVER)
        self.exchange(request)
        all_of_them = self.failing.asked
        self.settled(live)
        live = max(live, self.failing.live)
        for number in range(first, all_of_them, step):
            self.attempt(name, request, number, count, good)
            if self.server.process.poll() is not None:
                self.faults.append("%s: allocation %d of %d: the daemon died: %s" % (name, number, all_of_them, " | ".join(line for line in self.server.log().splitlines() if " in=" not in line)[-1500:]))
                return all_of_them
            if not self.settled(live):
                if self.failing.live <= live + LOSES.get(name, 0):
                    live = self.failing.live
                    continue
                self.faults.append("%s: allocation %d of %d: %d pieces in use, %d before" % (name, number, all_of_them, self.failing.live, live))
                live = self.failing.live
        return all_of_them
