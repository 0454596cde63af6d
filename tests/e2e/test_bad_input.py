"""Every kind of bad input: status, code and text; the daemon answers on as if nothing had been."""
import gzip
import json
import math
import struct
import time

import harness
from harness import expect_error, floats

ESTIMATE = "/v2/models/estimate/infer"
CLOUD = harness.sphere(600)


def infer(server, points, normals=None, **parameters):
    inputs = [("points", [len(points) // 3, 3], "FP32", points.tobytes())]
    if normals is not None:
        inputs.append(("normals", [len(normals) // 3, 3], "FP32", normals.tobytes()))
    headers, body = harness.infer_body(inputs, parameters)
    return server.post(ESTIMATE, body, headers)


def infer_json(server, message, **headers):
    return server.post(ESTIMATE, message if isinstance(message, bytes) else json.dumps(message).encode(), headers)


def test_empty_body(server):
    for path in ("/v1/estimate", ESTIMATE):
        expect_error(server.post(path, b""), 400, "invalid_argument", "body: got 0 bytes")
        expect_error(server.request("POST", path), 400, "invalid_argument", "body: got 0 bytes")


def test_too_few_points(server):
    expect_error(infer(server, harness.sphere(5)), 400, "invalid_argument", "points: got 5, need at least")
    expect_error(server.post("/v1/estimate", harness.ply(floats([]))), 400, "invalid_argument", "points: got 0, need at least")
    expect_error(infer(server, floats([])), 400, "invalid_argument", "points: got 0, need at least")


def test_values_that_are_no_numbers(server):
    for bad in (math.nan, math.inf, -math.inf):
        cloud = floats(CLOUD)
        cloud[3 * 17 + 1] = bad
        expect_error(infer(server, cloud), 400, "invalid_argument", "17")
        expect_error(server.post("/v1/estimate", harness.ply(cloud)), 400, "invalid_argument", "17")


def test_degenerate_clouds(server):
    expect_error(infer(server, floats([1, 2, 3] * 200)), 422, "degenerate_geometry")
    line = floats([c for i in range(200) for c in (i, 2 * i, -i)])
    expect_error(infer(server, line), 422, "degenerate_geometry", "line")
    doubled = floats(list(CLOUD) * 20)
    assert infer(server, doubled).status in (200, 422)
    started = time.monotonic()
    crowded = floats(list(CLOUD) + list(CLOUD[:3]) * 50000)
    expect_error(infer(server, crowded), 422, "degenerate_geometry", "points: 50001 coincide at (")
    assert time.monotonic() - started < 5 * harness.SLOW, "a crowded place takes quadratic time"


def test_far_outlier(server):
    response = infer(server, floats(list(CLOUD) + [1e6, 0, 0]), estimator="gmls", cover="all")
    assert response.status == 200, response.text[:300]
    _, outputs = harness.parse_infer(response)
    good = sum(abs(h + 1) < 0.1 for h in outputs["mean_curvature"][:600])
    assert good > 570, "the outlier spoils all but %d of 600 points" % good


def test_bad_normals(server):
    zero = floats(CLOUD)
    zero[30:33] = floats([0, 0, 0])
    expect_error(infer(server, CLOUD, zero), 400, "invalid_argument", "normals", "10")
    expect_error(infer(server, CLOUD, CLOUD[:300]), 400, "invalid_argument", "normals", "100", "600")


def test_unknown_names(server):
    expect_error(infer(server, CLOUD, quantities="normals,colour"), 400, "invalid_argument", "colour", "mean_curvature")
    expect_error(infer(server, CLOUD, colour="red"), 400, "invalid_argument", "colour", "quantities")
    expect_error(server.post("/v1/estimate?colour=red", harness.ply(CLOUD)), 400, "invalid_argument", "colour", "quantities")
    expect_error(server.post("/v1/estimate?quantities=colour", harness.ply(CLOUD)), 400, "invalid_argument", "colour")
    expect_error(infer(server, CLOUD, estimator="magic"), 400, "invalid_argument", "magic", "gmls")
    expect_error(server.post("/v1/paint", harness.ply(CLOUD)), 404, "not_found", "paint")
    expect_error(server.post("/v1/estimate?format=bmp", harness.ply(CLOUD)), 400, "invalid_argument", "bmp")
    expect_error(server.post("/v1/estimate?k=30&k=31", harness.ply(CLOUD)), 400, "invalid_argument", "given twice")
    expect_error(server.post("/v1/estimate?k", harness.ply(CLOUD)), 400, "invalid_argument", "name=value")
    expect_error(server.post("/v1/estimate?k=%zz", harness.ply(CLOUD)), 400, "invalid_argument", "percent")


def test_bad_k(server):
    for bad in ("0", "1000000000", "-1", "abc", "", "30.5", "99999999999999999999", "30 "):
        text = bad.replace(" ", "%20")
        expect_error(server.post("/v1/estimate?k=" + text, harness.ply(CLOUD)), 400, "invalid_argument", "k: got",
                     "12..500" if bad.lstrip("-").isdigit() and len(bad) < 12 else "")
    for bad in (0, 10**9, -1, "abc", 30.5, 1e300, True):
        expect_error(infer(server, CLOUD, k=bad), 400, "invalid_argument", "k: got")


def test_ply_that_lies(server):
    for count in (300, 599, 601, 10**9, 2**32, 2**63, 10**30, -1):
        expect_error(server.post("/v1/estimate", harness.ply(CLOUD, count)), 400, "invalid_argument")
    for broken in (b"ply\n", b"ply\nformat binary_little_endian 1.0\n", b"ply\nend_header\n",
                   harness.ply(CLOUD)[:-1], harness.ply(CLOUD).replace(b"float y", b"float x"),
                   harness.ply(CLOUD).replace(b"binary_little", b"binary_small"), b"ply\n" + b"comment x\n" * 100000):
        expect_error(server.post("/v1/estimate", broken), 400, "invalid_argument")


def test_truncated_binary(server):
    headers, body = harness.points_body(CLOUD)
    expect_error(server.post(ESTIMATE, body[:-1], headers), 400, "invalid_argument", "points")
    expect_error(server.post(ESTIMATE, body + b"x", headers), 400, "invalid_argument")
    expect_error(server.post(ESTIMATE, b"x" * 100, {"Inference-Header-Content-Length": 0}), 400, "invalid_argument")


def test_wrong_inference_header(server):
    _, body = harness.points_body(CLOUD)
    for bad in ("99999999999", "-1", "abc", "", "1e3", "0x10", str(len(body) + 1), "18446744073709551616", "+5"):
        expect_error(server.post(ESTIMATE, body, {"Inference-Header-Content-Length": bad}), 400, "invalid_argument",
                     "Inference-Header-Content-Length")
    for short in (1, 5, 20):
        expect_error(server.post(ESTIMATE, body, {"Inference-Header-Content-Length": short}), 400, "invalid_argument")


def test_broken_json(server):
    for bad in (b"{", b"[]", b"null", b"{}", b"\xff\xfe", b"{\"inputs\":[]}", b"{\"inputs\":{}}", b"x" * 1000,
                b"{\"inputs\":[{\"name\":\"points\"}]}", b"{\"a\":1,\"a\":2}", b"\x00" * 64):
        expect_error(infer_json(server, bad), 400, "invalid_argument")


def test_nesting_bombs(server):
    deep = b"{\"inputs\":[{\"name\":\"points\",\"shape\":[1,3],\"datatype\":\"FP32\",\"data\":" + b"[" * 100000
    for bad in (b"[" * 200000, b"{\"a\":" * 100000, deep, deep + b"]" * 100000, b"{\"inputs\":" + b"[[" * 60 + b"]]" * 60 + b"}"):
        expect_error(infer_json(server, bad), 400, "invalid_argument")


def test_bad_tensors(server):
    def with_points(**fields):
        tensor = dict({"name": "points", "shape": [2, 3], "datatype": "FP32", "data": [0, 0, 0, 1, 1, 1]}, **fields)
        return {"inputs": [tensor]}
    for fields in ({"shape": [-2, 3]}, {"shape": [2**62, 3]}, {"shape": [2**63, 2**63]}, {"shape": [3, 3]}, {"shape": [1, 3]},
                   {"shape": []}, {"shape": [2, 4]}, {"shape": [1] * 100}, {"shape": "2,3"}, {"datatype": "FP99"}, {"datatype": 7},
                   {"datatype": "BYTES"}, {"data": ["a"] * 6}, {"data": [None] * 6}, {"data": "text"}, {"name": "nodes"},
                   {"name": "x" * 1000}, {"parameters": {"binary_data_size": -1}}, {"parameters": {"binary_data_size": 2**63}}):
        expect_error(infer_json(server, with_points(**fields)), 400, "invalid_argument")
    tensor = with_points()["inputs"][0]
    expect_error(infer_json(server, {"inputs": [tensor, tensor]}), 400, "invalid_argument", "points")
    wanted = [{"name": "normals"}, {"name": "normals"}]
    expect_error(infer_json(server, {"inputs": [tensor], "outputs": wanted}), 400, "invalid_argument", "normals")
    headers, body = harness.infer_body([("points", [600, 3], "FP32", CLOUD.tobytes())], outputs=[{"name": "colour"}])
    expect_error(server.post(ESTIMATE, body, headers), 400, "invalid_argument", "colour")


def test_bad_npy(server):
    def npy(header):
        header = header.encode() + b" " * (-(len(header) + 11) % 64) + b"\n"
        return b"\x93NUMPY\x01\x00" + struct.pack("<H", len(header)) + header + CLOUD.tobytes()
    good = npy("{'descr': '<f4', 'fortran_order': False, 'shape': (600, 3), }")
    assert server.post("/v1/estimate?format=ply", good).status == 200
    for bad in ("{'descr': '|O', 'fortran_order': False, 'shape': (600, 3), }",
                "{'descr': '<f4', 'fortran_order': False, 'shape': (601, 3), }",
                "{'descr': '<f4', 'fortran_order': False, 'shape': (99999999999999999999, 3), }",
                "{'descr': '<f4', 'fortran_order': False, 'shape': (-1, 3), }",
                "{'descr': '<f4', 'fortran_order': False, 'shape': (600, 4", "", "import os"):
        response = server.post("/v1/estimate?format=ply", npy(bad))
        assert response.status in (400, 413, 415), response.text
        assert response.json["error"]
    assert server.post("/v1/estimate", b"\x93NUMPY\x01\x00\xff\xff").status == 400
    assert server.post("/v1/estimate", b"PK\x03\x04" + b"\x00" * 40).status == 400


def test_limits_of_points_and_body():
    with harness.Server(max_points=500, max_body_bytes=20000, discard_bytes=8000000) as server:
        expect_error(infer(server, CLOUD), 413, "too_large", "points: got 600", "500")
        expect_error(server.post("/v1/estimate", harness.ply(CLOUD)), 413, "too_large", "600", "500")
        expect_error(server.post("/v1/estimate", b"x" * 20001), 413, "too_large", "body: got 20001 bytes, need at most 20000")
        expect_error(server.post("/v1/estimate", b"x" * 6000000), 413, "too_large", "body: got 6000000 bytes")
        chunked = b"".join(b"%x\r\n%s\r\n" % (4000, b"x" * 4000) for _ in range(300)) + b"0\r\n\r\n"
        expect_error(server.post("/v1/estimate", chunked, {"Transfer-Encoding": "chunked"}), 413, "too_large",
                     "more than 20000 bytes")
        with server.connect() as s:
            s.sendall(harness.make_request("POST", "/v1/estimate", None, {"Content-Length": 10**9, "Expect": "100-continue"}))
            expect_error(harness.read_response(s), 413, "too_large", "body: got 1000000000 bytes, need at most 20000")
        with server.connect() as s:
            s.sendall(harness.make_request("POST", "/v1/estimate", None, {"Content-Length": 100, "Expect": "100-continue"}))
            assert s.recv(100).startswith(b"HTTP/1.1 100 ")
            s.sendall(b"x" * 100)
            assert harness.read_response(s).status == 415
        with server.connect() as s:
            s.sendall(harness.make_request("POST", "/v1/estimate", b"x" * 1000, {"Content-Length": 10**12}))
            expect_error(harness.read_response(s), 413, "too_large")
        assert server.metric("gnpd_rejected_total{reason=\"body_limit\"}") >= 5
        assert server.metric("gnpd_queue_bytes") == 0


def test_gzip_bombs():
    bomb = gzip.compress(b"\x00" * 200_000_000, 6)
    assert len(bomb) < 300_000
    with harness.Server(max_body_bytes="8M") as server:
        for path in ("/v1/estimate", ESTIMATE):
            expect_error(server.post(path, bomb, {"Content-Encoding": "gzip"}), 413, "too_large", "8388608")
        with open("/proc/%d/status" % server.process.pid) as file:
            peak = next(int(line.split()[1]) for line in file if line.startswith("VmHWM"))
        assert harness.SLOW > 1 or peak < 200_000, "the bomb made the daemon grow to %d KiB" % peak


def test_many_chunks_have_bounded_memory():
    with harness.Server(max_body_bytes="1M", discard_bytes=100000) as server:
        with server.connect() as s:
            s.sendall(harness.make_request("POST", "/v1/estimate", None, {"Transfer-Encoding": "chunked"}))
            try:
                for _ in range(200):
                    s.sendall(b"1\r\nx\r\n" * 10000)
                s.sendall(b"0\r\n\r\n")
            except (BrokenPipeError, ConnectionResetError):
                pass
            try:
                expect_error(harness.read_response(s), 413, "too_large")
            except ConnectionError:
                pass
        assert server.get("/v2/health/live").status == 200
        server.wait_metric("gnpd_queue_bytes", 0)
