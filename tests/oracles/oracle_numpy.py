#!/usr/bin/python3
"""The other side of test_npy: numpy writes what our decoder reads (`write DIR`) and reads what our encoder wrote (`read DIR`).

The arrays are a[i, j, ...] = 7 * flat index - 40, or the flat index modulo 2 for booleans, in row-major order."""
import json
import sys

import numpy as np


def array(dtype, shape):
    flat = np.arange(int(np.prod(shape)), dtype=np.int64)
    flat = flat % 2 if np.dtype(dtype).kind == "b" else (flat * 7 - 40 if np.dtype(dtype).kind != "u" else flat * 7)
    return flat.astype(dtype).reshape(shape)


def write(folder):
    names = []
    for code in "|b1 |i1 |u1 <i2 >i2 <u2 <i4 >i4 >u4 <i8 >i8 <u8 <f2 >f2 <f4 >f4 <f8 >f8".split():
        for shape in ((5, 3), (4,), (), (2, 3, 4), (0, 3)):
            for order in "CF":
                for version in ((1, 0), (2, 0), (3, 0)):
                    name = "%s_%s_%s_%d.npy" % (code[1:] + ("b" if code[0] == ">" else ""), "x".join(map(str, shape)), order, version[0])
                    with open(folder + "/" + name, "wb") as file:
                        np.lib.format.write_array(file, np.asarray(array(code, shape), order=order), version=version)
                    names.append((name, code[1] == "u", code[1] == "b", len(shape), int(np.prod(shape))))
    with open(folder + "/list", "w") as file:
        for name, unsigned, boolean, rank, count in names:
            file.write("%s %d %d %d %d\n" % (name, unsigned, boolean, rank, count))
    points = array("<f4", (6, 3))
    for name, save in (("stored.npz", np.savez), ("deflated.npz", np.savez_compressed)):
        save(folder + "/" + name, xyz=points, normals=array(">f8", (6, 3)), extra=array("<i4", (6, 2, 2)))
    np.save(folder + "/object.npy", np.array([{"a": 1}], dtype=object), allow_pickle=True)
    np.save(folder + "/struct.npy", np.zeros(3, dtype=[("x", "<f4"), ("y", "<f4")]))
    np.save(folder + "/complex.npy", np.zeros(3, dtype="<c8"))
    np.save(folder + "/text.npy", np.array(["ab"]))


def read(folder):
    with np.load(folder + "/ours.npz") as archive:
        assert sorted(archive.files) == ["flags", "metric", "parameters", "points"], archive.files
        assert json.loads(bytes(archive["parameters"])) == {"estimator": "gmls"}
        assert archive["points"].dtype == np.dtype("<f4") and archive["points"].shape == (2, 3)
        assert np.array_equal(archive["points"], np.arange(6, dtype="f4").reshape(2, 3))
        assert archive["metric"].shape == (2, 2, 2) and archive["metric"].dtype == np.dtype("<f8")
        assert np.array_equal(archive["metric"].ravel(), np.arange(8) / 10)
        assert archive["flags"].dtype == np.bool_ and archive["flags"].tolist() == [True, False]
    one = np.load(folder + "/ours.npy")
    assert one.dtype == np.dtype("<f8") and np.array_equal(one.ravel(), np.arange(8) / 10) and one.shape == (2, 2, 2)


if __name__ == "__main__":
    {"write": write, "read": read}[sys.argv[1]](sys.argv[2])
