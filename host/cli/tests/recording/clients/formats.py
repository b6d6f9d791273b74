"""Writes what other programs write: a log of a bus by python-can, a surface by meshio; and reads a surface back.

    formats.py logs LOG FOLDER      a candump log in every format that python-can writes
    formats.py meshes FOLDER        a tube in every format that meshio writes
    formats.py vtk FOLDER           the tube in every encoding of VTK's own XML formats
    formats.py read FILE.stl        corners of a surface, as meshio reads it
"""

import json
import sys
from pathlib import Path


def logs(log, folder):
    import can

    for ending in ["asc", "blf", "trc", "csv", "log"]:
        writer = can.Logger(str(folder / f"of.{ending}"))
        for message in can.LogReader(log):
            # The first channel of the formats that number them.
            message.channel = 0 if ending in ("asc", "blf", "trc") else "can0"
            writer.on_message_received(message)
        writer.stop()


def tube():
    import numpy as np

    around, rings, radius, length = 24, 9, 3.0, 40.0
    angles = 2 * np.pi * np.arange(around) / around
    points = [
        [length * ring / (rings - 1), radius * np.cos(angle), radius * np.sin(angle)]
        for ring in range(rings)
        for angle in angles
    ]
    triangles = []
    for ring in range(rings - 1):
        for side in range(around):
            a, b = around * ring + side, around * ring + (side + 1) % around
            # They face away from the lumen.
            triangles += [[a, b, a + around], [b, b + around, a + around]]
    return np.array(points), np.array(triangles)


def meshes(folder):
    import meshio

    points, triangles = tube()
    mesh = meshio.Mesh(points, [("triangle", triangles)])
    for name, options in [
        ("ascii.stl", {"binary": False}),
        ("binary.stl", {"binary": True}),
        ("ascii.ply", {"binary": False}),
        ("binary.ply", {"binary": True}),
        ("ascii.vtu", {"binary": False}),
        ("zlib.vtu", {"binary": True}),
        ("surface.obj", {}),
    ]:
        meshio.write(folder / name, mesh, **options)
    print(json.dumps({"triangles": len(triangles)}))


def vtk(folder):
    import vtk

    points, triangles = tube()
    corners, cells = vtk.vtkPoints(), vtk.vtkCellArray()
    for point in points:
        corners.InsertNextPoint(point)
    for triangle in triangles:
        cells.InsertNextCell(3, triangle.tolist())
    surface = vtk.vtkPolyData()
    surface.SetPoints(corners)
    surface.SetPolys(cells)
    grid = vtk.vtkUnstructuredGrid()
    grid.SetPoints(corners)
    grid.SetCells(vtk.VTK_TRIANGLE, cells)
    names = []
    for ending, data, writers in [
        ("vtp", surface, vtk.vtkXMLPolyDataWriter),
        ("vtu", grid, vtk.vtkXMLUnstructuredGridWriter),
    ]:
        for mode in ["Ascii", "Binary", "Appended"]:
            for packer in [None, "ZLib", "LZ4"]:
                for order in ["Little", "Big"]:
                    for base64 in [True, False] if mode == "Appended" else [True]:
                        writer = writers()
                        names.append(f"{mode}-{packer}-{order}-{base64}.{ending}")
                        writer.SetFileName(str(folder / names[-1]))
                        writer.SetInputData(data)
                        getattr(writer, f"SetDataModeTo{mode}")()
                        getattr(writer, f"SetByteOrderTo{order}Endian")()
                        writer.SetEncodeAppendedData(base64)
                        packing = {"ZLib": vtk.vtkZLibDataCompressor, "LZ4": vtk.vtkLZ4DataCompressor}
                        writer.SetCompressor(packing[packer]() if packer else None)
                        writer.Write()
    print(json.dumps({"triangles": len(triangles), "names": names}))


def read(path):
    import meshio
    import numpy as np

    mesh = meshio.read(path)
    corners = mesh.points[np.concatenate([cells.data for cells in mesh.cells])]
    print(json.dumps({
        "triangles": len(corners),
        "low": corners.min(axis=(0, 1)).tolist(),
        "high": corners.max(axis=(0, 1)).tolist(),
        "area": float(np.linalg.norm(np.cross(
            corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1).sum() / 2),
    }))


what, *rest = sys.argv[1:]
{"logs": logs, "meshes": meshes, "vtk": vtk, "read": read}[what](*map(Path, rest))
