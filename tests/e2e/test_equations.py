"""Equations on surfaces: sources as tensors and as columns of files, operators kept between requests, matrices."""
import array
import array
import ast
import io
import math
import struct
import subprocess
import tempfile
import threading
import zipfile

import harness
from harness import expect_error

COUNT = 1200
SPHERE = harness.sphere(COUNT)
Z = [SPHERE[3 * i + 2] for i in range(COUNT)]


def source(scale):
    return "source", [COUNT, 1], "FP64", array.array("d", [scale * z for z in Z]).tobytes()


def points():
    return "points", [COUNT, 3], "FP64", array.array("d", SPHERE).tobytes()


def infer(server, operation, inputs, **parameters):
    headers, body = harness.infer_body(inputs, parameters)
    return server.post("/v2/models/%s/infer" % operation, body, headers)


def metric(server, name):
    for line in server.get("/metrics").text.splitlines():
        if line.startswith("gnpd_" + name + " "):
            return float(line.split()[1])
    raise AssertionError("no metric " + name)


def worst(got, want):
    return max(abs(a - b) for a, b in zip(got, want))


def test_poisson_keeps_its_operator(server):
    hits, misses = metric(server, "prepared_cache_hits_total"), metric(server, "prepared_cache_misses_total")
    for turn, scale in enumerate((2.0, 6.0)):
        head, outputs = harness.parse_infer(infer(server, "poisson", [points(), source(scale)], estimator="gmls", k=31))
        assert worst(outputs["solution"], [scale / 2 * z for z in Z]) < 0.02 * scale
        assert head["parameters"]["operator_kept"] is bool(turn), head["parameters"]
    assert metric(server, "prepared_cache_hits_total") == hits + 1 and metric(server, "prepared_cache_misses_total") == misses + 1
    assert metric(server, "prepared_cache_operators") >= 1 and metric(server, "prepared_cache_bytes") > 100 * COUNT


def test_one_operator_is_made_once_for_many(server):
    misses, answers = metric(server, "prepared_cache_misses_total"), []

    def ask():
        answers.append(infer(server, "poisson", [points(), source(2.0)], estimator="gmls", k=33))

    threads = [threading.Thread(target=ask) for _ in range(6)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert [answer.status for answer in answers] == [200] * 6
    assert metric(server, "prepared_cache_misses_total") == misses + 1
    solutions = [harness.parse_infer(answer)[1]["solution"].tobytes() for answer in answers]
    assert len(set(solutions)) == 1


def test_no_cache_when_it_is_off():
    with harness.Server(prepared_cache_bytes=0) as server:
        for _ in range(2):
            head, _ = harness.parse_infer(infer(server, "poisson", [points(), source(2.0)], estimator="gmls"))
            assert head["parameters"]["operator_kept"] is False
        assert metric(server, "prepared_cache_bytes") == 0 and metric(server, "prepared_cache_evictions_total") == 2


def test_sources_are_columns_of_files(server):
    text = "# x y z source\n" + "".join("%r %r %r %r\n" % (*SPHERE[3 * i:3 * i + 3], 2 * Z[i]) for i in range(COUNT))
    response = server.post("/v1/poisson?estimator=gmls&outputs=solution&format=xyz", text.encode(), {"Content-Type": "text/plain"})
    assert response.status == 200, response.text[:300]
    rows = [[float(word) for word in line.split()] for line in response.text.splitlines() if not line.startswith("#")]
    assert len(rows) == COUNT and worst([row[3] for row in rows], Z) < 0.03
    expect_error(server.post("/v1/poisson?estimator=gmls", harness.ply(harness.floats(SPHERE))), 400, "invalid_argument",
                 'input "source": missing')


def test_heat_geodesic_spectrum(server):
    head, outputs = harness.parse_infer(infer(server, "heat", [points(), ("initial", *source(1.0)[1:])], estimator="gmls", dt=0.05, steps=2))
    assert worst(outputs["solution"], [z / 1.1 ** 2 for z in Z]) < 0.02 and abs(head["parameters"]["time"] - 0.1) < 1e-12
    head, outputs = harness.parse_infer(infer(server, "geodesic", [points()], estimator="gmls", source=3))
    assert outputs["distance"][3] == 0 and 2.9 < max(outputs["distance"]) < 3.3
    assert set(outputs) == {"distance"}
    head, outputs = harness.parse_infer(infer(server, "spectrum", [points()], estimator="gmls", count=4))
    assert worst(outputs["eigenvalues"], [0, 2, 2, 2]) < 0.03 and len(outputs["eigenvectors"]) == 4 * COUNT


def test_conditions_and_snapshots(server):
    """A square of 20 x 20: heat between edges held at 0 and 1 settles to x, and so does what a flux of 1 drives."""
    def doubles(values):
        return array.array("d", values).tobytes()

    side = 20
    square = [[i % side / (side - 1), i // side / (side - 1), 0.0] for i in range(side * side)]
    flat, xs = [c for p in square for c in p], [p[0] for p in square]
    cloud = ("points", [len(square), 3], "FP64", doubles(flat))
    ends = ("fixed", [len(square)], "BOOL", bytes(x in (0, 1) for x in xs))
    values = ("values", [len(square), 1], "FP64", doubles(x if x in (0, 1) else 9 for x in xs))
    head, outputs = harness.parse_infer(infer(server, "heat", [cloud, ends, values], dt=1, steps=6, snapshot_every=3))
    assert worst(outputs["solution"], xs) < 1e-6 and list(outputs["snapshot_time"]) == [0, 3, 6]
    assert len(outputs["snapshots"]) == 3 * len(square) and list(outputs["snapshots"][-len(square):]) == list(outputs["solution"])
    flux = ("flux", [len(square), 1], "FP64", doubles(((x == 1) - (x == 0)) * (0.5 if y in (0, 1) else 1) for x, y, _ in square))
    head, outputs = harness.parse_infer(infer(server, "poisson", [cloud, flux]))
    assert head["parameters"]["system"] == "symmetric" and worst(outputs["solution"], [x - 0.5 for x in xs]) < 1e-6
    points = ("source_points", [2], "INT64", struct.pack("<2q", 0, 399))
    head, outputs = harness.parse_infer(infer(server, "poisson", [cloud, points, ("source_strengths", [2, 1], "FP64", doubles((1, -1)))]))
    assert abs(outputs["solution"][0] + outputs["solution"][399]) < 1e-6 and outputs["solution"][0] > 0.5
    expect_error(infer(server, "poisson", [cloud, ("source_points", [1], "INT64", struct.pack("<q", 400))]), 400, "invalid_argument",
                 "source_points[0]: got 400, need an index below 400")


def test_what_goes_along_geodesics(server):
    at = lambda i: SPHERE[3 * i:3 * i + 3]
    dot = lambda a, b: sum(x * y for x, y in zip(a, b))
    pairs = [(3, i) for i in range(0, COUNT, 7)]
    inputs = [points(), ("vectors", [COUNT, 3], "FP64", array.array("d", [1.0, 0, 0] * COUNT).tobytes()),
              ("pairs", [len(pairs), 2], "INT64", array.array("q", [i for pair in pairs for i in pair]).tobytes())]
    head, outputs = harness.parse_infer(infer(server, "geodesic", inputs, estimator="gmls", source=3, log=True))
    assert set(outputs) == {"distance", "pair_distance", "parallel", "log", "basis"}, set(outputs)
    distance, log, parallel, basis = outputs["distance"], outputs["log"], outputs["parallel"], outputs["basis"]
    assert list(outputs["pair_distance"]) == [distance[i] for _, i in pairs]
    size = math.sqrt(1 - at(3)[0] ** 2)
    for i in range(COUNT):
        assert abs(math.hypot(*log[2 * i:2 * i + 2]) - distance[i]) < 1e-9
        assert abs(math.sqrt(dot(parallel[3 * i:3 * i + 3], parallel[3 * i:3 * i + 3])) - size) < 0.01
        far = math.acos(max(-1, min(1, dot(at(3), at(i)))))
        for k in range(2):  # the log map of a sphere
            wanted = dot(at(i), basis[3 * k:3 * k + 3]) * far / math.sin(far) if 0 < far < 2 else 0
            assert far >= 2 or abs(log[2 * i + k] - wanted) < 0.1, (i, k, log[2 * i + k], wanted)
    expect_error(infer(server, "geodesic", inputs[:2] + [("pairs", [1, 2], "INT64", array.array("q", [0, COUNT]).tobytes())], estimator="gmls"), 400,
                 "invalid_argument", "pairs[0]: got %d, need an index below %d" % (COUNT, COUNT))
    several = ("sources", [COUNT], "BOOL", array.array("B", [i < 2 for i in range(COUNT)]).tobytes())
    expect_error(infer(server, "geodesic", [points(), several], estimator="gmls", log=True), 400, "invalid_argument", "log: got 2 sources, need 1")


def test_laplacian_as_matrix_market(server):
    response = server.post("/v1/laplacian?estimator=gmls&format=mtx", harness.ply(harness.floats(SPHERE)))
    assert response.status == 200 and response.headers["content-type"] == "application/x-matrix-market", response.text[:300]
    lines = response.text.splitlines()
    assert lines[0] == "%%MatrixMarket matrix coordinate real general"
    entries = [line.split() for line in lines if not line.startswith("%")]
    rows, columns, count = map(int, entries[0])
    assert rows == columns == COUNT and len(entries) == count + 1
    sums = [0.0] * (COUNT + 1)
    for row, _, value in entries[1:]:
        sums[int(row)] += float(value)
    assert max(map(abs, sums)) < 1e-6
    expect_error(server.post("/v1/estimate?estimator=gmls&format=mtx", harness.ply(harness.floats(SPHERE))), 406, "not_acceptable",
                 "mtx: needs row_offsets")


def arrays_of(npz):
    """Every array of an archive as (descr, shape, its bytes), without numpy."""
    found = {}
    with zipfile.ZipFile(io.BytesIO(npz)) as archive:
        for name in archive.namelist():
            data = archive.read(name)
            length = struct.unpack("<H", data[8:10])[0]
            header = ast.literal_eval(data[10:10 + length].decode().strip())
            assert data[:8] == b"\x93NUMPY\x01\x00" and (10 + length) % 64 == 0 and not header["fortran_order"]
            found[name[:-4]] = header["descr"], header["shape"], data[10 + length:]
    return found


def numbers_of(found, name):
    descr, shape, data = found[name]
    return list(array.array({"<i8": "q", "<f8": "d"}[descr], data))


def test_the_symmetric_laplacian_as_scipy_reads_it(server):
    cloud = harness.sphere(COUNT)
    doubled = cloud + cloud[:30]  # ten points twice: they are merged
    for given, filtered in ((cloud, ""), (doubled, ""), (cloud, "&filter=true")):
        path = "/v1/laplacian?estimator=gmls&system=symmetric&format=npz" + filtered
        response = server.post(path, harness.ply(harness.floats(given)))
        assert response.status == 200, response.text[:300]
        found = arrays_of(response.body)
        assert found["format"] == ("|S3", (), b"csr"), found["format"]
        offsets, columns, data = (numbers_of(found, name) for name in ("indptr", "indices", "data"))
        mass, values = numbers_of(found, "mass"), numbers_of(found, "values")
        n = len(mass)
        assert numbers_of(found, "shape") == [n, n] and len(offsets) == n + 1 and len(numbers_of(found, "kept")) == n
        assert n == COUNT or filtered and COUNT / 2 < n <= COUNT, n
        entries = {(i, columns[e]): data[e] for i in range(n) for e in range(offsets[i], offsets[i + 1])}
        assert len(entries) == offsets[n] == len(data)
        assert all(entries[j, i] == value for (i, j), value in entries.items())
        assert all((value > 0) == (i == j) for (i, j), value in entries.items()) and min(mass) > 0
        laplacian = [-data[e] / mass[i] for i in range(n) for e in range(offsets[i], offsets[i + 1])]
        assert worst(laplacian, values) < 1e-9 * max(map(abs, values))
        read_by_scipy(response.body, n)


def read_by_scipy(npz, n):
    code = ("import sys, numpy, scipy.sparse; s = scipy.sparse.load_npz(sys.argv[1]); "
            "m = numpy.load(sys.argv[1])['mass']; print(s.shape == (%d, %d), abs(s - s.T).max() == 0, "
            "abs(s @ numpy.ones(len(m))).max() < 1e-9)" % (n, n))
    if subprocess.run(["/usr/bin/python3", "-c", "import scipy.sparse"], stderr=subprocess.DEVNULL).returncode != 0:
        print("skipped: scipy")
        return
    with tempfile.NamedTemporaryFile(suffix=".npz") as file:
        file.write(npz)
        file.flush()
        said = subprocess.run(["/usr/bin/python3", "-c", code, file.name], capture_output=True, text=True)
    assert said.stdout.split() == ["True"] * 3, (said.stdout, said.stderr)


def test_the_symmetric_laplacian_as_matrix_market(server):
    parts = "&outputs=row_offsets,columns,values"
    for outputs, kind in (("", "symmetric"), ("&outputs=mass", "symmetric"), (parts, "general")):
        path = "/v1/laplacian?estimator=gmls&system=symmetric&format=mtx" + outputs
        response = server.post(path, harness.ply(harness.floats(SPHERE)))
        assert response.status == 200, response.text[:300]
        assert response.text.splitlines()[0] == "%%MatrixMarket matrix coordinate real " + kind
    refused = server.post("/v1/laplacian?estimator=gmls&outputs=stiffness", harness.ply(harness.floats(SPHERE)))
    expect_error(refused, 400, "invalid_argument", "outputs: got stiffness")


def test_a_spectrum_with_fixed_points_and_a_shift(server):
    mask = "fixed", [COUNT], "BOOL", bytes(z < 0 for z in Z)
    head, outputs = harness.parse_infer(infer(server, "spectrum", [points(), mask], estimator="gmls", count=3))
    # half a sphere with its rim held: odd harmonics, l = 1, 2, 2
    assert worst(outputs["eigenvalues"], [2, 6, 6]) < 0.4, outputs["eigenvalues"]
    assert all(outputs["eigenvectors"][3 * i] == 0 for i in range(COUNT) if Z[i] < 0)
    head, outputs = harness.parse_infer(infer(server, "spectrum", [points()], estimator="gmls", count=7, shift=12))
    assert worst(outputs["eigenvalues"], [12] * 7) < 0.2, outputs["eigenvalues"]
    head, outputs = harness.parse_infer(infer(server, "spectrum", [points()], estimator="gmls", count=7, shift=12,
                                              system="symmetric"))
    assert worst(outputs["eigenvalues"], [12] * 7) < 0.5 and not any(outputs["imaginary"]), outputs["eigenvalues"]


def test_a_matrix_of_a_filtered_cloud(server):
    """It once took the daemon with it, or a later request: of many sizes, and all must be answered by one process."""
    for count in (120, 300, 1100, 3000):
        cloud = harness.sphere(count)
        for i in range(3, count, 10):
            for c in range(3):
                cloud[3 * i + c] *= 1.3
        headers, body = harness.points_body(cloud, filter=True, estimator="gmls")
        head, outputs = harness.parse_infer(server.post("/v2/models/laplacian/infer", body, headers))
        offsets, kept = outputs["row_offsets"], set(outputs["kept"])
        assert len(offsets) == count + 1 and len(kept) < count, (len(offsets), len(kept))
        assert all((offsets[i + 1] > offsets[i]) == (i in kept) for i in range(count))
        assert server.post("/v1/laplacian?filter=true&estimator=adaptive&format=npz", harness.ply(cloud)).status == 200


def test_equations_refuse_what_they_cannot_do(server):
    short = ("source", [COUNT - 1, 1], "FP64", array.array("d", [0.0] * (COUNT - 1)).tobytes())
    expect_error(infer(server, "poisson", [points(), short], estimator="gmls"), 400, "invalid_argument", "source")
    nan = ("source", [COUNT, 1], "FP64", array.array("d", [float("nan")] * COUNT).tobytes())
    expect_error(infer(server, "poisson", [points(), nan], estimator="gmls"), 400, "invalid_argument", "source")
    for parameter, value in (("drop", 0.7), ("function_degree", 9), ("screening", -1), ("solver", "magic"), ("tolerance", 1)):
        expect_error(infer(server, "poisson", [points(), source(2.0)], estimator="gmls", **{parameter: value}), 400, "invalid_argument", parameter)
    with harness.Server(queue_bytes="20M") as small:
        many, zeros = harness.sphere(20000), array.array("d", [0.0] * 20000)
        body = [("points", [20000, 3], "FP64", array.array("d", many).tobytes()), ("source", [20000, 1], "FP64", zeros.tobytes())]
        expect_error(infer(small, "poisson", body, estimator="gmls"), 413, "too_large", "queue-bytes")
