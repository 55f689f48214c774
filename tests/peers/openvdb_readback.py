#!/usr/bin/env python3
"""Reads a .vdb written by scantle with OpenVDB and compares every voxel with a .npy or .nrrd.

    python3 tests/peers/openvdb_readback.py FILE.vdb FILE.nrrd

Needs OpenVDB's Python binding (Debian: python3-openvdb, run with /usr/bin/python3) and numpy.
Writes nothing; not run in CI.
"""

import sys

import numpy as np

try:
    import openvdb as vdb
except ImportError:
    import pyopenvdb as vdb


def dense(path):
    """Values indexed z, y, x, and origin and axes where the file has them."""
    if path.endswith(".npy"):
        return np.load(path), None, None
    with open(path, "rb") as file:
        fields = {}
        for line in iter(lambda: file.readline().decode().strip(), ""):
            name, _, value = line.partition(":")
            fields[name] = value.strip()
        raw = np.frombuffer(file.read(), np.uint8)
    vectors = [
        np.array([float(v) for v in part.strip("() ").split(",")])
        for part in (fields["space directions"] + " " + fields["space origin"]).split(" ")
    ]
    sizes = [int(size) for size in fields["sizes"].split()]
    return raw.reshape(sizes[::-1]), vectors[3], np.array(vectors[:3])


def main():
    values, origin, axes = dense(sys.argv[2])
    wanted = values.transpose(2, 1, 0) != 0
    grids, metadata = vdb.readAll(sys.argv[1])
    assert len(grids) == 1 and grids[0].name == "voxels", grids
    grid = grids[0]
    assert isinstance(grid, vdb.BoolGrid) and grid.background is False
    count = int(wanted.sum())
    assert grid.activeVoxelCount() == count, (grid.activeVoxelCount(), count)
    assert grid.metadata["file_voxel_count"] == count
    found = np.zeros(wanted.shape, bool)
    grid.copyToArray(found)
    assert np.array_equal(found, wanted), "values differ"
    if count:
        set_voxels = np.argwhere(wanted)
        low, high = set_voxels.min(axis=0), set_voxels.max(axis=0)
        assert grid.evalActiveVoxelBoundingBox() == (tuple(low), tuple(high))
        assert grid.metadata["file_bbox_min"] == tuple(low)
        assert grid.metadata["file_bbox_max"] == tuple(high)
    # Active values are exactly those that are true: no tile reaches past them.
    active = sum(
        int(np.prod(np.array(item.max) - np.array(item.min) + 1))
        for item in grid.citerOnValues()
        if item.value
    )
    assert active == count, (active, count)
    if origin is not None:
        for index in [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1), (3, 5, 7)]:
            place = grid.transform.indexToWorld(index)
            assert np.allclose(place, origin + np.array(index) @ axes, 1e-13, 1e-12), index
    print(
        f"{sys.argv[1]}: {count} voxels agree;",
        f"{grid.leafCount()} leaves, {grid.nonLeafCount()} other nodes,",
        f"OpenVDB {'.'.join(str(v) for v in vdb.LIBRARY_VERSION)}",
    )


main()
