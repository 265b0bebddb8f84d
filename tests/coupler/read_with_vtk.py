"""Read every step of a VTKHDF file with VTK's own reader, in this process alone: python read_with_vtk.py FILE NPZ."""

import sys

import numpy as np
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkCommonCore import vtkCommand
from vtkmodules.vtkIOHDF import vtkHDFReader


def arrays(grid, step):
    """All arrays of one step under '<step>/<name>'."""
    found = {f"{step}/points": vtk_to_numpy(grid.GetPoints().GetData())}
    polygons = grid.IsA("vtkPolyData")
    cells = grid.GetPolys() if polygons else grid.GetCells()
    found[f"{step}/cells"] = vtk_to_numpy(cells.GetConnectivityArray())
    found[f"{step}/ends"] = vtk_to_numpy(cells.GetOffsetsArray())
    for data in (grid.GetPointData(), grid.GetCellData()):
        for i in range(data.GetNumberOfArrays()):
            found[f"{step}/{data.GetArrayName(i)}"] = vtk_to_numpy(data.GetArray(i))
    return found


def main(path, result):
    """Read `path`, write `result`; exit code 1 if VTK complains."""
    complaints = []
    reader = vtkHDFReader()
    reader.AddObserver(vtkCommand.ErrorEvent, lambda *_: complaints.append("VTK error"))
    reader.SetFileName(path)
    reader.UpdateInformation()
    found = {"steps": reader.GetNumberOfSteps()}
    for step in range(reader.GetNumberOfSteps()):
        reader.SetStep(step)
        reader.Update()
        grid = reader.GetOutputDataObject(0)
        found |= {name: values.copy() for name, values in arrays(grid, step).items()}
        found[f"{step}/time"] = vtk_to_numpy(grid.GetFieldData().GetArray("Time"))[0]
    np.savez(result, **found)
    return 1 if complaints else 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
