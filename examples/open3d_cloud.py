"""A frame as points in Open3D, with grey by its direct light and with normals, in a file.

    python examples/open3d_cloud.py http://127.0.0.1:8000 cloud.ply

Needs open3d, which is 400 MB and not among the extras of transientcam.
"""
# ruff: noqa: T201 - an example prints what it finds

import sys

import numpy as np
import open3d

import transientcam

url, path = sys.argv[1:]
with transientcam.Camera(url) as camera:
    frame = camera.frame("pointcloud", wait_s=10.0)
    light = camera.frame("direct", number=frame.frame).array.ravel()

points = frame.array.reshape(3, -1).T
seen = np.isfinite(points).all(axis=1) & np.isfinite(light)
white = np.percentile(light[seen], 99)
grey = np.clip(light[seen] / white, 0.0, 1.0)

cloud = open3d.geometry.PointCloud(open3d.utility.Vector3dVector(points[seen].astype(float)))
cloud.colors = open3d.utility.Vector3dVector(
    np.repeat(grey[:, np.newaxis], 3, axis=1).astype(float)
)
cloud.estimate_normals()
cloud.orient_normals_towards_camera_location()
open3d.io.write_point_cloud(path, cloud)
print(f"wrote {path}: {len(cloud.points)} of {len(points)} points of frame {frame.frame}")
