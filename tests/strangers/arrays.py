"""Arrays that other programs write as HDF5: groups with units, tables, MATLAB 7.3 by MATLAB and by others."""
import h5py
import numpy

from parts import by_hand
from sensors import DEG, G0, industrial


def mark(node, word):
    """As MATLAB does: a string that ends with a zero."""
    kind = h5py.h5t.C_S1.copy()
    kind.set_size(len(word))
    kind.set_strpad(h5py.h5t.STR_NULLTERM)
    attribute = h5py.h5a.create(node.id, b"MATLAB_class", kind, h5py.h5s.create(h5py.h5s.SCALAR))
    attribute.write(numpy.array(word.encode(), dtype=f"S{len(word)}"), mtype=kind)


def matlab(path, named, own):
    """Columns along the other dimension; OWN: as MATLAB itself marks them, structures with the names of their fields."""
    with h5py.File(path, "w", userblock_size=512) as out:
        for name, values in named.items():
            fields = values if isinstance(values, dict) else {name: values}
            group = out.create_group(name) if isinstance(values, dict) else out
            if isinstance(values, dict):
                mark(group, "struct")
                letters = numpy.empty(len(fields), dtype=object)
                letters[:] = [numpy.array(list(field), dtype="S1") for field in fields]
                group.attrs.create("MATLAB_fields", letters, dtype=h5py.vlen_dtype(numpy.dtype("S1")))
            for field, array in fields.items():
                data = group.create_dataset(field, data=numpy.atleast_2d(array.T))
                if own:
                    mark(data, "double")
                else:
                    data.attrs["MATLAB_class"] = numpy.bytes_("double")
    with open(path, "r+b") as out:
        out.write(b"MATLAB 7.3 MAT-file, Platform: PCWIN64".ljust(116) + b" " * 8 + b"\x00\x02IM")


def hdf5(folder, rng):
    """One log in five layouts of HDF5, in g and deg/s or in SI without a word."""
    g, a, t, f, w = by_hand(rng, industrial, 16)
    force, rate = a.read(f, 100.0, rng), g.read(w, 100.0, rng)
    with h5py.File(folder / "groups.h5", "w") as out:
        for name, values, unit in (("accel", force / G0, "g"), ("gyro", rate / DEG, "deg/s"), ("time", t, "s")):
            out.create_dataset(f"imu0/{name}", data=values, compression="gzip").attrs["units"] = unit
        out["notes"] = numpy.arange(5)
        out["maker"] = "somebody"
    rows = numpy.zeros(len(t), dtype=[("t", "f8"), *[(n, "f4") for n in ("ax", "ay", "az", "gx", "gy", "gz")], ("flag", "S3")])
    rows["t"] = t
    for k, axis in enumerate("xyz"):
        rows["a" + axis], rows["g" + axis] = force[:, k], rate[:, k]
    with h5py.File(folder / "table.hdf5", "w") as out:
        out.create_dataset("IMU/table", data=rows)
    named = {"acc": force, "gyr": rate, "t": t[:, None]}
    matlab(folder / "own.mat", named, True)
    matlab(folder / "structure.mat", {"imu": named}, True)
    matlab(folder / "others.mat", named, False)
    return {"g": g, "a": a}
