"""A sweep's chunks on a Dask cluster: the same function of the same numbers, so the same bytes.

Needs the extra ``cluster`` (`distributed`). A worker that dies costs its chunk, which another one runs again.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from functools import lru_cache, partial

from forklift.base.errors import ForkliftError
from forklift.base.extras import how_to_install
from forklift.ensemble import chunks
from forklift.ensemble.controllers import of_data, to_data
from forklift.ensemble.members import Members
from forklift.ensemble.specification import Specification, check
from forklift.plant.forklift.truck import Truck
from forklift.plant.forklift.truck_file import Value

NamedValues = tuple[str, tuple[tuple[str, Value], ...]]

Runner = Callable[[list[int]], Iterator[tuple[int, bytes]]]

PATIENCE_S = 10.0
"""For a scheduler to answer."""


def runner(members: Members, address: str) -> Runner:
    """What makes chunks on the scheduler at an address.

    Raises
    ------
    ForkliftError
        ``"extra-missing"`` without `distributed`, ``"scheduler-unreachable"``.
    """
    try:
        from distributed import Client, as_completed
    except ImportError:
        raise ForkliftError(
            "extra-missing",
            f"a sweep on a cluster needs Dask; install it with {how_to_install('cluster', 'distributed')}",
            name="cluster",
        ) from None
    try:
        client = Client(address, timeout=PATIENCE_S)  # type: ignore[no-untyped-call]
    except (OSError, ValueError) as error:
        raise ForkliftError(
            "scheduler-unreachable",
            f"no Dask scheduler answers at {address} ({type(error).__name__}); start one, or correct the "
            f"address",
            name="scheduler",
            value=address,
        ) from None
    spec = members.specification.model_dump_json()
    truck = (members.truck.name, tuple(members.truck.values.items()))
    controller = json.dumps(to_data(members.controller)) if members.controller else ""

    def run(missing: list[int]) -> Iterator[tuple[int, bytes]]:
        with client:
            futures = client.map(partial(_numbered, spec, truck, controller), missing, pure=False)
            for future in as_completed(futures):  # type: ignore[no-untyped-call]
                yield future.result()
                future.release()

    return run


def _numbered(spec: str, truck: NamedValues, controller: str, chunk: int) -> tuple[int, bytes]:
    return chunk, made(spec, truck, controller, chunk)


def made(spec: str, truck: NamedValues, controller: str, chunk: int) -> bytes:
    """The bytes of one chunk, on a worker: one thread, as the cluster has one task a thread."""
    return chunks.encoded(chunks.run(_members(spec, truck, controller), chunk))


@lru_cache(maxsize=2)
def _members(spec: str, truck: NamedValues, controller: str) -> Members:
    found: Specification = check(json.loads(spec))
    own = of_data(json.loads(controller)) if controller else None
    return Members(found, Truck(truck[0], dict(truck[1])), own, 1)
