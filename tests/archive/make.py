"""Write one small record of each kind as this release writes it: `python -m tests.archive.make`.

The files of a released schema version are never written again; raise SCHEMA_VERSION first.
"""

from pathlib import Path

from gudgeon.modaldb.hdf5 import write_record
from gudgeon.modaldb.records import KINDS, SCHEMA_VERSION
from tests.modaldb.samples import INPUTS, SAMPLES

ARCHIVE = Path(__file__).parent


def main(archive: Path = ARCHIVE) -> list[Path]:
    """Write the files of the current schema version into `archive` and return them."""
    folder = archive / f"v{SCHEMA_VERSION}"
    folder.mkdir(parents=True, exist_ok=True)
    files = [folder / f"{kind}.h5" for kind in KINDS]
    for path in files:
        path.unlink(missing_ok=True)
        write_record(path, path.stem, SAMPLES[path.stem](), INPUTS)
    return files


if __name__ == "__main__":
    for written in main():
        print(written)
