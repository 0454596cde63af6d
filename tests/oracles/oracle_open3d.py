#!/usr/bin/python3
"""The other side of PLY: Open3D writes clouds, the daemon at URL answers them, Open3D reads the answers.
oracle_open3d.py URL FOLDER. Exit status 77 where Open3D is not installed."""
import sys
import urllib.request

try:
    import numpy as np
    import open3d
except ImportError:
    sys.exit(77)


def sphere(count):
    i = np.arange(count)
    z, turn = 1 - (2 * i + 1) / count, np.pi * (3 - np.sqrt(5)) * i
    r = np.sqrt(1 - z * z)
    return np.stack([r * np.cos(turn), r * np.sin(turn), z], 1)


def ask(url, sent, received):
    with open(sent, "rb") as file:
        request = urllib.request.Request(url + "/v1/estimate?estimator=gmls&quantities=normals,mean_curvature,shape_operator", file.read())
    with urllib.request.urlopen(request, timeout=60) as answer, open(received, "wb") as file:
        file.write(answer.read())


def check(path, points, tolerance):
    cloud = open3d.io.read_point_cloud(path)
    assert np.abs(np.asarray(cloud.points) - points).max() <= tolerance
    assert (np.asarray(cloud.normals) * points).sum(1).min() > 0.9999
    fields = open3d.t.io.read_point_cloud(path).point
    for name in ("quality", "scalar_mean_curvature", "scalar_shape_operator_0", "scalar_shape_operator_3"):
        worst = np.abs(getattr(fields, name).numpy() + 1).max()
        assert worst < 0.1, "%s: off by %g" % (name, worst)


def main(url, folder):
    points, sent, received = sphere(2000), folder + "/sent.ply", folder + "/received.ply"
    cloud = open3d.geometry.PointCloud(open3d.utility.Vector3dVector(points))
    for normals in (False, True):
        if normals:
            cloud.normals = open3d.utility.Vector3dVector(points)
        for ascii in (False, True):
            open3d.io.write_point_cloud(sent, cloud, write_ascii=ascii)
            ask(url, sent, received)
            check(received, points, 1e-6 if ascii else 1e-15)
    mesh = open3d.geometry.TriangleMesh.create_sphere(1, 30)
    open3d.io.write_triangle_mesh(sent, mesh)
    ask(url, sent, received)
    assert len(open3d.io.read_point_cloud(received).points) == len(mesh.vertices)


if __name__ == "__main__":
    main(*sys.argv[1:])
