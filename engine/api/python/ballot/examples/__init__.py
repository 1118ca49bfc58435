"""Small programs with ballot, to read and to start from: lidar, street_scan, ambient_occlusion, line_of_sight; and with
kernels in GLSL: path_tracer, foliage, irradiance, view_factors, occlusion_kernel. Each runs by itself,

    python -m ballot.examples.lidar

and its docstrings are tested."""
