#!/usr/bin/env python3
"""Reads files written by scantle with other programs and compares them with a reference.

    mkdir DIR
    SCANTLE_PEERS=DIR cargo test --lib write_files_for_peers -- --ignored
    python3 tests/peers/formats_readback.py DIR

Needs nibabel, numpy, pynrrd, SimpleITK, pyvista (with vtk) and trimesh. Writes nothing; not run in CI.
OpenVDB has a script of its own, openvdb_readback.py.
"""

import json
import pathlib
import sys

import nibabel
import nrrd
import numpy as np
import pyvista
import SimpleITK
import trimesh
import vtk

FOLDER = pathlib.Path(sys.argv[1])
NEAR = 1e-12
checks = 0


def check(name, good):
    global checks
    checks += 1
    if not good:
        sys.exit(f"{name}: differs")


def same(name, found, wanted, tolerance=NEAR):
    found, wanted = np.asarray(found, float), np.asarray(wanted, float)
    scale = max(1.0, np.abs(wanted).max())
    check(name, found.shape == wanted.shape and np.abs(found - wanted).max() <= tolerance * scale)


class Reference:
    def __init__(self, path):
        about = json.loads(path.read_text())
        self.name = path.name.removesuffix(".reference.json")
        self.dims = about["dims"]
        self.origin = np.array(about["origin"])
        self.axes = np.array(about["axes"])
        self.spacing = np.linalg.norm(self.axes, axis=1)
        raw = np.fromfile(path.with_name(self.name + ".reference.raw"), about["type"])
        self.values = raw.reshape(self.dims[::-1])  # indexed z, y, x

    def file(self, extension):
        path = FOLDER / f"{self.name}.{extension}"
        return str(path) if path.exists() else None


def with_pynrrd(reference, path):
    values, header = nrrd.read(path, index_order="C")
    check(path, np.array_equal(values, reference.values))
    same(path, header["space directions"], reference.axes)
    same(path, header["space origin"], reference.origin)


def with_itk(reference, path):
    image = SimpleITK.ReadImage(path)
    check(path, np.array_equal(SimpleITK.GetArrayFromImage(image), reference.values))
    # ITK reads coordinates of some headers in single precision.
    for index in [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1), [d - 1 for d in reference.dims]]:
        wanted = reference.origin + np.array(index) @ reference.axes
        found = image.TransformIndexToPhysicalPoint([int(i) for i in index])
        same(f"{path} voxel {index}", found, wanted, 1e-6)


def with_nibabel(reference, path):
    image = nibabel.load(path)
    values = np.asanyarray(image.dataobj)  # indexed x, y, z
    check(path, np.array_equal(values.transpose(2, 1, 0), reference.values))
    same(path, image.affine[:3, :3], reference.axes.T)
    same(path, image.affine[:3, 3], reference.origin)


def with_numpy(reference, path):
    values = np.load(path)
    check(path, np.array_equal(values, reference.values))


def with_pyvista(reference, path):
    grid = pyvista.read(path)
    check(path, np.array_equal(grid.cell_data["voxels"], reference.values.ravel()))
    same(path, grid.spacing, reference.spacing)
    for cell in [0, 1, reference.dims[0], int(np.prod(reference.dims)) - 1]:
        x, y = cell % reference.dims[0], cell // reference.dims[0] % reference.dims[1]
        z = cell // reference.dims[0] // reference.dims[1]
        wanted = reference.origin + np.array([x, y, z]) @ reference.axes
        bounds = np.reshape(grid.get_cell(cell).bounds, (3, 2))
        same(f"{path} cell {cell}", bounds.mean(axis=1), wanted)


def with_trimesh(reference, path):
    with open(path, "rb") as file:
        grid = trimesh.exchange.binvox.load_binvox(file)
    found = np.asarray(grid.encoding.dense)  # indexed x, y, z
    check(path, np.array_equal(found, reference.values.transpose(2, 1, 0) != 0))
    # trimesh puts binvox voxels on n points across the scale, (n - 1) steps apart, so its
    # placement differs from the format's description; the corner is compared alone.
    same(path, grid.transform[:3, 3], reference.origin - 0.5 * reference.spacing)


def mesh_with_trimesh():
    mesh = trimesh.load(FOLDER / "tetrahedron.glb", force="mesh", process=False)
    same("tetrahedron.glb", mesh.vertices, [[0, 0, 0], [1, 0, 0], [0, 2, 0], [0, 0, 3]])
    check("tetrahedron.glb", mesh.is_watertight and abs(mesh.volume - 1.0) < NEAR)


def mesh_with_vtk():
    reader = vtk.vtkGLTFReader()
    reader.SetFileName(str(FOLDER / "tetrahedron.glb"))
    reader.Update()
    blocks = reader.GetOutput()
    mesh = pyvista.wrap(blocks).combine()
    check("tetrahedron.glb", mesh.n_points == 4 and mesh.n_cells == 4)


PEERS = [
    ("nrrd", with_pynrrd),
    ("nrrd", with_itk),
    ("mha", with_itk),
    ("mhd", with_itk),
    ("nii", with_nibabel),
    ("npy", with_numpy),
    ("vti", with_pyvista),
    ("binvox", with_trimesh),
]

references = sorted(FOLDER.glob("*.reference.json"))
for path in references:
    reference = Reference(path)
    for extension, peer in PEERS:
        file = reference.file(extension)
        if file:
            peer(reference, file)
mesh_with_trimesh()
mesh_with_vtk()
if not references:
    sys.exit("no reference found; see the top of this script")
print(
    f"{checks} comparisons hold:",
    f"pynrrd {nrrd.__version__}, SimpleITK {SimpleITK.Version_VersionString()},",
    f"nibabel {nibabel.__version__}, numpy {np.__version__}, pyvista {pyvista.__version__}, vtk {vtk.VTK_VERSION},",
    f"trimesh {trimesh.__version__}",
)
