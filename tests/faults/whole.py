"""Is a file of results whole?"""

import csv
import json
import xml.etree.ElementTree as ET
from pathlib import Path

import h5py
import numpy as np
from PIL import Image

END = {".pdf": b"%%EOF", ".svg": b"</svg>"}


def left_over(folder: Path) -> list[str]:
    """Files that a writer should have taken away."""
    return sorted(str(p.relative_to(folder)) for p in folder.rglob(".*"))


def _read(_: str, node: h5py.Group | h5py.Dataset) -> None:
    if isinstance(node, h5py.Dataset):
        node[()]


def check_whole(path: Path) -> None:
    """Read a file to its end; raises something where it is not whole."""
    suffix = path.suffix
    if suffix == ".json":
        json.loads(path.read_text(encoding="utf-8"))
    elif suffix in (".h5", ".hdf5"):
        with h5py.File(path) as file:
            file.visititems(_read)
    elif suffix in (".png", ".gif"):
        with Image.open(path) as image:
            for k in range(getattr(image, "n_frames", 1)):
                image.seek(k)
                assert np.asarray(image).size
    elif suffix in (".vtu", ".pvd"):
        ET.parse(path)
    elif suffix == ".csv":
        text = path.read_text(encoding="utf-8")
        rows = list(csv.reader(text.splitlines()))
        assert text.endswith("\n")
        assert len({len(row) for row in rows}) == 1
    else:
        assert path.read_bytes().rstrip().endswith(END[suffix]), path
