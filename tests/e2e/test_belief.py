"""No answer is absurd in silence: clouds as people have them are warned of, refused by name, or answered rightly."""
import array
import math
import os
import subprocess
import tempfile

import field
import harness
from harness import SLOW, Server, expect_error

WEIGHTS = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "weights")
GNP = os.path.abspath(os.environ.get("GNP", "build/gnp"))


def trained():
    """A daemon of its own with the models that are shipped."""
    content = {}
    for name in ("any", "fit_clean_30k", "fit_clean_50k", "fit_noise_70k", "fit_outlier_50k"):
        with open(os.path.join(WEIGHTS, name + ".safetensors"), "rb") as file:
            content[name + ".safetensors"] = file.read()
    return Server(weights=content)


def ask(server, operation, points, inputs=(), **parameters):
    kind = "FP64" if points.typecode == "d" else "FP32"
    tensors = [("points", [len(points) // 3, 3], kind, points.tobytes())]
    tensors += [(name, shape, datatype, values.tobytes()) for name, shape, datatype, values in inputs]
    headers, body = harness.infer_body(tensors, parameters)
    return server.post("/v2/models/%s/infer" % operation, body, headers)


def column(values):
    values = array.array("d", values)
    return [len(values), 1], "FP64", values


def kinds(response):
    """Of the warnings, which the header counts."""
    assert response.status == 200, response.text
    warnings = harness.parse_infer(response)[0]["parameters"].get("warnings", "")
    found = [w.split(": ")[0] for w in warnings.split("; ") if w]
    assert response.headers["x-gnpd-warnings"] == str(len(found)), (response.headers, warnings)
    return set(found)


def ones(points):
    return column([1.0] * (len(points) // 3))


def heights(points):
    return column(points[2::3])


def test_equations_say_what_is_not_to_be_believed():
    """Of collocation that was asked for."""
    with trained() as server:
        flat, jittered, crossings, rough = field.square(12), field.square(40, 0.3), field.grid_crossings(), field.random_sphere()
        for cloud in (flat, field.open_sphere(), rough):
            found = kinds(ask(server, "heat", cloud, [("initial", *ones(cloud))], dt=0.01, steps=100, system="square"))
            assert {"heat", "operator"} <= found, found
        for cloud, wanted in ((jittered, "eigenvalues"), (crossings, "eigenvalues"), (rough, "operator")):
            found = kinds(ask(server, "spectrum", cloud, count=10, system="square"))
            assert wanted in found and "operator" in found, (wanted, found)
        for cloud in (jittered, field.square(40), field.latitudes()):
            source = column([x - y for x, y in zip(cloud[0::3], cloud[1::3])])
            found = kinds(ask(server, "poisson", cloud, [("source", *source)], system="square"))
            assert found & {"operator", "energy"}, found
        assert "sheets" in kinds(ask(server, "geodesic", field.roll(5)))
        assert kinds(ask(server, "laplacian", field.roll(5))) & {"stencils", "crossings"}


def test_equations_hold_where_collocation_does_not():
    """By themselves they take the operator that holds, and say why."""
    pi2 = 9.8696044010893586

    def solved(operation, cloud, *inputs, **parameters):
        response = ask(server, operation, cloud, inputs, **parameters)
        assert not kinds(response) - {"rows", "mean"}, (operation, response.headers)
        return harness.parse_infer(response)

    with trained() as server:
        for cloud in (field.square(12), field.open_sphere(), field.random_sphere(), field.scan_lines(0, 160, 20), field.roll(5)):
            response = ask(server, "heat", cloud, [("initial", *ones(cloud))], dt=0.01, steps=100)
            u = harness.parse_infer(response)[1]["solution"]
            assert max(abs(x - 1) for x in u) < 1e-10, (min(u), max(u))
        for cloud, wanted, off in ((field.square(40, 0.3), [0, pi2, pi2, 2 * pi2, 4 * pi2, 4 * pi2], 0.05),
                                   (field.random_sphere(), [0, 2, 2, 2, 6, 6, 6, 6, 6], 0.04),
                                   (field.grid_crossings(), [0, 2, 2, 2, 6, 6, 6, 6, 6], 0.04)):
            head, outputs = solved("spectrum", cloud, count=len(wanted))
            assert head["parameters"]["system"] == "symmetric" and head["parameters"]["system_because"], head
            for got, want in zip(outputs["eigenvalues"], wanted):
                assert abs(got - want) < off * max(want, 1), (got, wanted)
        cloud = field.square(40)
        head, outputs = solved("poisson", cloud, ("source", *column([pi2 * math.cos(math.pi * x) for x in cloud[0::3]])))
        assert head["parameters"]["system_because"] == "stars are open, at a rim or where normals disagree", head
        assert max(abs(u - math.cos(math.pi * x)) for u, x in zip(outputs["solution"], cloud[0::3])) < 0.02
        even = field.sphere(3000)
        head, _ = solved("spectrum", even, count=4)
        assert head["parameters"]["system"] == "square", head
        head, outputs = solved("geodesic", cloud, ("sources", [1600], "BOOL", array.array("B", field.square_edge(40))))
        wanted = [min(x, 1 - x, y, 1 - y) for x, y in zip(cloud[0::3], cloud[1::3])]
        assert sum(abs(d - w) for d, w in zip(outputs["distance"], wanted)) < 0.002 * sum(wanted)
        lines = field.scan_lines(0, 160, 20)
        outputs = harness.parse_infer(ask(server, "geodesic", lines, source=1680))[1]
        for i, d in enumerate(outputs["distance"]):
            straight = math.dist(lines[3 * i:3 * i + 3], lines[3 * 1680:3 * 1680 + 3])
            assert straight * (1 - 1e-9) <= d <= 1.01 * straight + 1e-9, (i, d, straight)


def test_an_operator_that_is_kept_warns_again():
    with trained() as server:
        cloud = field.random_sphere()
        answers = [ask(server, "poisson", cloud, [("source", *heights(cloud))], system="square") for _ in range(2)]
        assert [harness.parse_infer(a)[0]["parameters"]["operator_kept"] for a in answers] == [False, True]
        first, second = (kinds(a) for a in answers)
        assert "operator" in first and first == second, (first, second)


def test_points_that_coincide_are_merged_and_said(server):
    twice = field.sphere(1000) * 2
    for operation, name in (("laplacian", None), ("geodesic", None), ("spectrum", None), ("poisson", "source"), ("heat", "initial")):
        inputs = [(name, *heights(twice))] if name else []
        found = kinds(ask(server, operation, twice, inputs, estimator="gmls", **({"dt": 1e-3} if operation == "heat" else {})))
        assert "copies" in found, (operation, found)


def test_clouds_say_what_is_not_to_be_believed():
    with trained() as server:
        for cloud, wanted in ((field.scan_lines(), {"rows"}), (field.latitudes(), {"rows"}), (field.nested(4), {"sheets"}),
                              (field.torus(300), {"resolution"}), (field.national_grid(), {"precision"})):
            found = kinds(ask(server, "estimate", cloud))
            assert wanted <= found, (wanted, found)
        assert "normals" in kinds(ask(server, "estimate", field.scan_lines(), weights="fit_clean_30k"))
        assert "dropped" in kinds(ask(server, "filter", field.noisy_sphere(), weights="fit_outlier_50k", alpha=0.1))
        for more in ({}, {"weights": "fit_noise_70k"}):
            head = harness.parse_infer(ask(server, "filter", field.noisy_sphere(), **more))[0]
            assert head["parameters"]["kept"] > 9500, "the default keeps noise, and what the warning recommends helps"
        rows = array.array("d")
        for i, x in enumerate(field.sphere(500)):
            rows.append(x)
            if i % 3 == 2:
                rows.extend((float(i % 256), 17.0, 200.0))
        text = "\n".join(" ".join("%.9g" % x for x in rows[6 * i:6 * i + 6]) for i in range(500))
        expect_error(server.post("/v1/estimate", text.encode(), {"Content-Type": "text/plain"}), 400, "invalid_argument", "columns 4 to 6 have length")
        for name in ("sphere", "torus"):
            cloud = getattr(field, name)(3000)
            for operation, more in (("estimate", {}), ("filter", {}), ("flow", {"steps": 2}), ("laplacian", {}), ("geodesic", {}), ("spectrum", {})):
                found = kinds(ask(server, operation, cloud, **more))
                assert not found, (name, operation, found)
            for operation, more in (("poisson", "source"), ("heat", "initial")):
                found = kinds(ask(server, operation, cloud, [(more, *heights(cloud))], **({"dt": 1e-3} if operation == "heat" else {})))
                assert not found - ({"mean"} if operation == "poisson" else set()), (name, operation, found)
        few = ask(server, "laplacian", field.sphere(120), filter=True, weights="fit_noise_70k")
        head, outputs = harness.parse_infer(few)
        assert few.status == 200 and len(outputs["row_offsets"]) == 121 and 0 < len(outputs["kept"]) <= 120, few.headers


def test_the_command_line_says_it_on_standard_error():
    def run(operation, cloud, *flags, columns=()):
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "cloud.csv")
            with open(path, "w") as file:
                file.write(",".join(["x", "y", "z", *(name for name, _ in columns)]) + "\n")
                for i in range(len(cloud) // 3):
                    file.write(",".join("%.17g" % x for x in [*cloud[3 * i:3 * i + 3], *(values[i] for _, values in columns)]) + "\n")
            done = subprocess.run([GNP, operation, path, "--local", "--weights-dir", WEIGHTS, "-o", os.path.join(folder, "out.npz"), *flags],
                                  stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, timeout=120 * SLOW)
            return done.returncode, done.stderr

    def warned(kind, *arguments, **more):
        code, said = run(*arguments, **more)
        assert code == 0 and any(line.startswith("gnp: warning: %s: " % kind) for line in said.splitlines()), (kind, code, said)

    warned("rows", "estimate", field.scan_lines())
    warned("normals", "estimate", field.scan_lines(), "--weights", "fit_clean_30k")
    warned("sheets", "estimate", field.nested(4))
    warned("resolution", "estimate", field.torus(300))
    warned("precision", "estimate", array.array("d", field.national_grid()))
    warned("dropped", "filter", field.noisy_sphere(), "--weights", "fit_outlier_50k", "--alpha", "0.1")
    flat = field.square(12)
    square = ("--system", "square")
    warned("heat", "heat", flat, "--dt", "0.01", "--steps", "100", *square, columns=[("initial", [1.0] * 144)])
    warned("eigenvalues", "spectrum", field.square(40, 0.3), *square)
    warned("eigenvalues", "spectrum", field.grid_crossings(), *square)
    warned("operator", "spectrum", field.random_sphere(), "--count", "25", *square)
    warned("sheets", "geodesic", field.roll(5))
    warned("rows", "estimate", field.latitudes())
    assert run("geodesic", field.square(40), columns=[("sources", field.square_edge(40))]) == (0, "")
    warned("stencils", "laplacian", field.roll(5))
    for cloud in (field.open_sphere(), field.random_sphere()):
        warned("heat", "heat", cloud, "--dt", "0.01", "--steps", "100", *square, columns=[("initial", [1.0] * (len(cloud) // 3))])
    for cloud in (field.square(40), field.square(40, 0.3), field.latitudes()):
        warned("operator", "poisson", cloud, *square, columns=[("source", [x - y for x, y in zip(cloud[0::3], cloud[1::3])])])
    twice = field.sphere(500) * 2
    for operation, columns in (("laplacian", []), ("geodesic", []), ("spectrum", []), ("poisson", [("source", twice[2::3])])):
        warned("copies", operation, twice, columns=columns)
    code, said = run("laplacian", field.sphere(120), "--filter", "--weights", "fit_noise_70k")
    assert code == 0, said
    for name in ("sphere", "torus"):
        cloud = getattr(field, name)(3000)
        for operation in ("estimate", "filter", "flow", "laplacian", "geodesic", "spectrum"):
            assert run(operation, cloud) == (0, ""), (name, operation)
        assert run("heat", cloud, "--dt", "1e-3", columns=[("initial", cloud[2::3])]) == (0, ""), name
    code, said = run("estimate", field.scan_lines(), "--quiet")
    assert code == 0 and said == "", said
