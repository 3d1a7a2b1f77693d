"""Prints what Open3D finds in the files of the command line: a line of JSON for each."""
import json
import sys

import numpy
import open3d

for path in sys.argv[1:]:
    if path.endswith(".pcd"):
        points, triangles, coloured = numpy.asarray(open3d.io.read_point_cloud(path).points), [], True
    else:
        mesh = open3d.io.read_triangle_mesh(path)
        points, triangles = numpy.asarray(mesh.vertices), numpy.asarray(mesh.triangles)
        coloured = mesh.has_vertex_colors() or len(mesh.triangle_material_ids) > 0
    print(json.dumps({
        "points": len(points),
        "triangles": len(triangles),
        "low": points.min(axis=0).tolist() if len(points) else None,
        "high": points.max(axis=0).tolist() if len(points) else None,
        "first": points[0].tolist() if len(points) else None,
        "coloured": bool(coloured),
    }))
