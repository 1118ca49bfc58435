"""Sensors that scan scenes: spinning and solid-state lidar, depth cameras and panoramas, to point clouds.

    lidar = ballot.sensors.spinning(np.deg2rad(np.linspace(-25, 15, 64)), 1800, near=0.5, far=100)
    cloud = lidar.scan(scene, poses, returns=3, alpha=True)   # structured: x y z range intensity ring time id
    message = ballot.sensors.PointCloud2.of(cloud)            # members as ROS's sensor_msgs/PointCloud2

Sensor    beams of any Pattern: Sensor(ballot.Camera.pinhole(640, 480, K, distortion=d)) is a depth camera,
          Sensor(ballot.Camera.panorama(2048, 1024)) sees all around.
Returns   first, last, strongest or several of each beam; beams of several rays merge what these meet.
Motion    poses between the beginning and the end of a sweep; a Motion moves instances meanwhile.

>>> scene = ballot.Scene([[-9, -9, -2], [9, -9, -2], [0, 18, -2]], [[0, 1, 2]], ids=7)
>>> sensor = ballot.sensors.spinning(np.deg2rad([-60, -30, 30]), 360)
>>> cloud = sensor.scan(scene, fields=("xyz", "range", "ring", "id"))
>>> sorted(set(cloud["ring"].tolist())), set(cloud["id"].tolist()), bool((abs(cloud["z"] + 2) < 1e-6).all())
([0, 1], {7}, True)
"""

from ._clouds import FIELDS, PointCloud2, PointField
from ._motion import Motion
from ._sensors import Sensor, point_dtype, rosette, solid_state, spinning

__all__ = [
    "FIELDS",
    "Motion",
    "PointCloud2",
    "PointField",
    "Sensor",
    "point_dtype",
    "rosette",
    "solid_state",
    "spinning",
]
