"""MAT-files: version 5 and older through scipy, version 7.3 (HDF5) through h5py.

Every numeric vector is a signal; the field ``pressure`` of the struct ``log`` is ``log.pressure``, and a
struct array's elements are ``log(1)``, ``log(2)``, … Vectors of a struct that has a vector ``time``, directly
or further up, are on that time; all others are on the vector that is ``time_s``. A text ``unit`` or ``units``
in a struct is the unit of the vectors beside it; in version 7.3 a vector may have it as an attribute.

Not read: timeseries and other objects, cells, complex numbers, struct arrays of version 7.3.
"""

from __future__ import annotations

import importlib
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from forklift.base.arrays import Floats
from forklift.recordings.channels import table
from forklift.recordings.formats.optional import require
from forklift.recordings.formats.signals import Choose, Place, Series, Signals

_HDF5 = b"\x89HDF\r\n\x1a\n"
_USERBLOCKS = (0, 512, 1024, 2048)  # HDF5 File Format Specification, III.A: where the signature may stand
_DEEPEST = 8
_TIME = "time"
_UNITS = ("unit", "units")


def read(place: Place, choose: Choose) -> Signals:
    """The chosen vectors of a MAT-file.

    Raises
    ------
    ForkliftError
        ``"extra-missing"`` if h5py is needed and not there, ``"column-no-signal"`` for a variable that is
        called as a channel and is no vector of real numbers, and what `choose` raises.
    """
    with Path(place.path).open("rb") as file:
        head = file.read(_USERBLOCKS[-1] + len(_HDF5))
    tree = _hdf5(place) if any(head[k:].startswith(_HDF5) for k in _USERBLOCKS) else _version5(place)
    series: dict[str, Series] = {}
    passed: dict[str, str] = {}
    for name, node in tree.items():
        _collect(name, node, None, series, passed)
        if name in table() and name not in series:
            raise place.error(
                "column-no-signal",
                f"{name} is {_said(node)}, where a vector of real numbers is wanted; write it as one, or "
                "rename it if it is something else",
                channel=name,
            )
    return Signals({name: series[name] for name in choose(list(series))}, passed=passed)


def _said(node: Any) -> str:
    """What a variable is that is no signal."""
    node = _bare(node)
    if not isinstance(node, np.ndarray):
        return "a struct" if isinstance(node, dict) else "no array of numbers"
    if node.size == 0:
        return "empty"
    if node.size == 1:
        return "a single value"
    if node.dtype.kind == "c":
        return "complex"
    return f"an array of {' x '.join(map(str, node.shape))}"


@dataclass(frozen=True)
class _Leaf:
    """A vector with the unit that the file gives it."""

    values: Any
    unit: str


def _collect(
    name: str,
    node: Any,
    time: Floats | None,
    series: dict[str, Series],
    passed: dict[str, str],
    unit: str = "",
) -> None:
    """All vectors in the tree below `node`, and what else holds numbers."""
    if isinstance(node, dict):
        own = _vector(node.get(_TIME))
        unit = next((text for field in _UNITS if (text := _text(node.get(field)))), "")
        for field, child in node.items():
            if own is None or field != _TIME:
                _collect(f"{name}.{field}", child, time if own is None else own, series, passed, unit)
    elif isinstance(node, list):
        for k, child in enumerate(node, start=1):
            _collect(f"{name}({k})", child, time, series, passed)
    elif (values := _vector(node)) is not None:
        series[name] = Series(values, time, node.unit if isinstance(node, _Leaf) else unit)
    elif isinstance(bare := _bare(node), np.ndarray) and bare.dtype.kind in "fiubc" and bare.size > 1:
        passed[name] = _said(bare)


def _text(node: Any) -> str:
    """What a char array says; empty if it is none."""
    if isinstance(node, np.ndarray) and node.dtype.kind == "U" and node.size == 1:
        return str(node.item()).strip()
    return node.strip() if isinstance(node, str) else ""


def _bare(node: Any) -> Any:
    """A node without the unit that the file gives it."""
    return node.values if isinstance(node, _Leaf) else node


def _vector(node: Any) -> Floats | None:
    node = _bare(node)
    if not isinstance(node, np.ndarray) or node.dtype.kind not in "fiub":
        return None
    if node.size < 2 or node.size != max(node.shape):
        return None
    return np.asarray(node, dtype=np.float64).ravel()


def _version5(place: Place) -> dict[str, Any]:
    variables = importlib.import_module("scipy.io").loadmat(place.path, struct_as_record=False)
    return {name: _plain(value, 0) for name, value in variables.items() if not name.startswith("__")}


def _plain(value: Any, depth: int) -> Any:
    """scipy's structs as dictionaries, its struct arrays as lists."""
    if depth > _DEEPEST:
        return None
    if hasattr(value, "_fieldnames"):
        return {field: _plain(getattr(value, field), depth + 1) for field in value._fieldnames}
    if isinstance(value, np.ndarray) and value.dtype == object:
        elements = [
            _plain(element, depth + 1) for element in value.ravel() if hasattr(element, "_fieldnames")
        ]
        return elements[0] if len(elements) == 1 else elements
    return value


def _hdf5(place: Place) -> dict[str, Any]:
    h5py = require("h5py", "mat", place)
    with h5py.File(place.path, "r") as file:
        return _group(h5py, file, 0)


def _group(h5py: Any, group: Any, depth: int) -> dict[str, Any]:
    tree: dict[str, Any] = {}
    for name in group:
        if name.startswith("#") or depth > _DEEPEST:  # "#refs#", "#subsystem#": MATLAB's own
            continue
        node = group.get(name)
        if isinstance(node, h5py.Group):
            tree[name] = _group(h5py, node, depth + 1)
        elif isinstance(node, h5py.Dataset) and node.dtype.kind in "fiub" and not _is_text(node):
            stated = next((str(_plain_text(node.attrs[of])) for of in _UNITS if of in node.attrs), "")
            tree[name] = _Leaf(node[()], stated.strip()) if stated else node[()]
        elif isinstance(node, h5py.Dataset) and name in _UNITS and node.dtype.kind == "u":
            tree[name] = "".join(map(chr, node[()].ravel()))
    return tree


def _plain_text(value: Any) -> str:
    return value.decode("utf-8", "replace") if isinstance(value, bytes) else str(value)


def _is_text(dataset: Any) -> bool:
    """Whether MATLAB stored letters, or the size of something empty, as numbers."""
    return dataset.attrs.get("MATLAB_class") in (b"char", "char") or "MATLAB_empty" in dataset.attrs
