"""Run the studies of a cohort that are not finished, on Dask, and gather what became of them."""

import importlib.util
import sys
import tempfile
import threading
import time
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from gaitval.apps.cohort.answers import outcome_of
from gaitval.apps.cohort.identity import REAL, fingerprint
from gaitval.apps.cohort.table import Study
from gaitval.errors import ConfigurationError, GaitvalError
from gaitval.partial_files import remove_abandoned

if TYPE_CHECKING:
    from distributed import Client

    from gaitval.apps.cohort.store import Store

NEEDED: Final = ("cryptography", "dask", "distributed", "fsspec", "psutil", "statsmodels")
POLL: Final = 0.2
"""s to wait for a study to be done, before the scheduler is looked after."""
LOOKING: Final = 5.0
"""s between two words while inputs are looked at, which takes 5 ms for a study."""
ASKING: Final = 2.0
"""s between two questions to the scheduler how many workers there are, while nothing is done."""

_Json = dict[str, Any]
_Notify = Callable[["CohortState"], None]


@dataclass(frozen=True)
class CohortState:
    """How far a cohort is.

    Attributes
    ----------
    found : studies whose outcome was known before the first one started.
    refused : of `found`, those whose input cannot be used; the others were finished already.
    looked : studies whose inputs were looked at, while this goes on; 0 before and after.
    dashboard : address of Dask's page; empty if there is none.
    outcome : what has just become of a study; None otherwise.
    workers : there now.
    """

    total: int
    found: int
    done: int
    failed: int
    workers: int
    dashboard: str
    seconds: float
    outcome: _Json | None = None
    refused: int = 0
    looked: int = 0

    @property
    def left(self) -> float | None:
        """Estimate of the seconds that are left, from the studies done so far; None at first."""
        ours = self.done - self.found
        return None if ours <= 0 else self.seconds / ours * (self.total - self.done)


def require() -> None:
    """Raise ConfigurationError, with the line to run, unless the extra `cohort` is installed."""
    missing = [name for name in NEEDED if importlib.util.find_spec(name) is None]
    if not missing:
        return
    root = Path(__file__).parents[3]
    checkout = (root / "pyproject.toml").is_file()
    what = f"-c {root}/constraints.txt -e '{root}[cohort]'" if checkout else "'gaitval[cohort]'"
    raise ConfigurationError(
        f"a cohort needs {', '.join(missing)}, which a plain gaitval does without. Install it:\n"
        f"    {sys.executable} -m pip install {what}"
    )


def run_cohort(
    studies: Sequence[Study],
    address: str,
    *,
    scheduler: str | None = None,
    workers: int | None = None,
    threads: int = 1,
    retries: int = 3,
    without_tls: bool = False,
    function: str = REAL,
    notify: _Notify | None = None,
    meanwhile: Callable[[], object] | None = None,
) -> list[_Json]:
    """Run every study that is not finished; one that fails stops no other.

    Parameters
    ----------
    address : folder or object storage of the studies, see `store.Store`.
    scheduler, workers, without_tls : see `cluster.client_of`.
    threads : of each study.
    retries : how often a study is started again after its worker or its process was lost.
    function : "module:function" that does a study.
    notify : called whenever something has happened.
    meanwhile : called once the first studies are on their way; it may take seconds.

    Returns
    -------
    list of dict
        What became of each study, in the order of `studies` (`task.run_order`).

    Raises
    ------
    ClusterError : the scheduler does not answer, or has gone; finished studies are kept.
    """
    require()
    from gaitval.apps.cohort.store import OF_STORE, Store
    from gaitval.apps.cohort.task import OF_CLUSTER

    for prefix in (OF_CLUSTER, OF_STORE):  # of a killed cohort, even if there is nothing left to do
        remove_abandoned(Path(tempfile.gettempdir()), prefix, "")
    store = Store(address)
    store.check()
    progress = _Progress(len(studies), notify)
    outcomes, orders = _known_and_ordered(studies, store, function, threads, progress.looked)
    progress.begin(outcomes)
    progress.report(None)
    if orders:
        from gaitval.apps.cohort.cluster import client_of

        with client_of(
            scheduler, workers, threads, retries, without_tls=without_tls, shared=store.local
        ) as client:
            progress.report(client)
            for outcome in outcomes_of(client, orders, retries):
                if outcome is not None:
                    outcomes[outcome["name"]] = outcome
                    progress.report(client, outcome)
                elif meanwhile is not None:
                    meanwhile()
                    meanwhile = None
    return [outcomes[study.name] for study in studies]


class _Progress:
    """Calls `notify`, if there is one, with how far a cohort of `total` studies is."""

    def __init__(self, total: int, notify: _Notify | None) -> None:
        self._total, self._notify = total, notify
        self._began, self._found, self._refused = 0.0, 0, 0
        self._outcomes: dict[str, _Json] = {}

    def looked(self, number: int) -> None:
        """The inputs of this `number` of studies were looked at."""
        if self._notify is not None:
            self._notify(CohortState(self._total, 0, 0, 0, 0, "", 0.0, looked=number))

    def begin(self, outcomes: dict[str, _Json]) -> None:
        """The clock runs; `outcomes` are known already, and later ones are put there."""
        self._began, self._found, self._outcomes = time.monotonic(), len(outcomes), outcomes
        self._refused = self._failed()

    def _failed(self) -> int:
        return sum(each["status"] != "finished" for each in self._outcomes.values())

    def report(self, client: "Client | None", outcome: _Json | None = None) -> None:
        """What has become of a study, or only how many workers the `client` has."""
        if self._notify is None:
            return
        self._notify(
            CohortState(
                total=self._total,
                found=self._found,
                done=len(self._outcomes),
                failed=self._failed(),
                workers=len(client.scheduler_info(n_workers=-1)["workers"]) if client else 0,
                dashboard=_dashboard(client),
                seconds=time.monotonic() - self._began,
                outcome=outcome,
                refused=self._refused,
            )
        )


def _known_and_ordered(
    studies: Sequence[Study],
    store: "Store",
    function: str,
    threads: int,
    looked: Callable[[int], object],
) -> tuple[dict[str, _Json], list[_Json]]:
    """What has become of studies already, by name, and orders for the others. `looked` hears now
    and then of how many it is known.
    """
    from gaitval.apps.cohort.task import order_of

    where = str(store.local.resolve()) if store.local else store.address
    outcomes: dict[str, _Json] = {}
    orders = []
    reported = time.monotonic()
    for number, study in enumerate(studies):
        if time.monotonic() - reported >= LOOKING:
            reported = time.monotonic()
            looked(number)
        try:
            found = fingerprint(study, function)
        except GaitvalError as error:
            outcomes[study.name] = _refused(study.name, " ".join(str(error).split()))
            continue
        known = store.finished(study.name)
        if known is not None and known.get("fingerprint") == found:
            outcomes[study.name] = known
        else:
            about = study.model_dump(mode="json", exclude_defaults=True)
            orders.append(order_of(about, found, where, function=function, threads=threads))
    return outcomes, orders


def outcomes_of(client: "Client", orders: Sequence[_Json], retries: int) -> Iterator[_Json | None]:
    """What becomes of `orders` on the cluster of `client`, in the order in which they are done;
    None while nothing is.

    A study whose process was lost is tried again up to `retries` times. Raises ClusterError if the
    scheduler has gone.
    """
    from distributed import as_completed

    from gaitval.apps.cohort.cluster import ClusterError
    from gaitval.apps.cohort.task import answer

    some_done = threading.Event()
    tries = dict.fromkeys((order["study"]["name"] for order in orders), 1)

    def submitted(order: _Json, number: int) -> Any:
        name = order["study"]["name"]
        # A key of its own for each attempt: Dask answers a known key with its old result.
        key = f"{name}-{order['fingerprint'][:8]}-{number}"
        future = client.submit(answer, order, key=key, pure=False, priority=-position[name])
        future.add_done_callback(lambda _: some_done.set())
        return future

    position = {order["study"]["name"]: number for number, order in enumerate(orders)}
    # Dask gives a worker several studies at once and takes few of them back, so that others have
    # nothing to do in the end. A study takes minutes: the next one can wait until a thread is free.
    left, futures = deque(orders), dict[Any, _Json]()
    waiting, room, checked_at = as_completed(), 0, -ASKING
    while futures or left:
        if left and time.monotonic() - checked_at >= ASKING:
            room, checked_at = max(_threads(client), 1), time.monotonic()
        while left and len(futures) < room:
            order = left.popleft()
            future = submitted(order, 1)
            futures[future] = order
            waiting.add(future)
        batch = waiting.next_batch(block=False)
        if not batch:
            if client.status not in ("running", "connecting"):
                raise ClusterError(
                    "the Dask scheduler has gone. Finished studies are kept: the same command "
                    "continues with the others."
                )
            some_done.wait(POLL)
            some_done.clear()
            yield None
        for future in batch:
            order = futures.pop(future)
            name = order["study"]["name"]
            outcome = _outcome(order, future)
            if outcome["status"] == "cancelled":
                raise ClusterError(
                    "the Dask scheduler has gone, or somebody cancelled the studies. Finished ones "
                    "are kept: the same command continues with the others."
                )
            # The process was killed, perhaps for memory: a fault of gaitval would only come again.
            if outcome["status"] == "lost" and tries[name] <= retries:
                tries[name] += 1
                again = submitted(order, tries[name])
                futures[again] = order
                waiting.add(again)
                continue
            yield {**outcome, "tries": tries[name]}


def _dashboard(client: "Client | None") -> str:
    """Address of Dask's page; a cluster that is started here has none."""
    own = client is None or client.cluster is not None
    return "" if client is None or own else str(client.dashboard_link)


def _threads(client: "Client") -> int:
    """Of all workers: studies that can run at the same time."""
    workers = client.scheduler_info(n_workers=-1)["workers"]
    return sum(int(each["nthreads"]) for each in workers.values())


def _outcome(order: _Json, future: Any) -> _Json:
    """The result of a task, or why there is none."""
    name = order["study"]["name"]
    if future.status == "finished":
        try:
            return outcome_of(future.result(), name, order["fingerprint"])
        except (TypeError, ValueError) as refused:  # TypeError: it would have to be unpickled
            message = str(refused).partition("\n")[0]
            return _refused(name, f"a worker's answer is refused: {message}", "fault")
    if future.status == "cancelled":
        return _refused(name, "cancelled", status="cancelled")
    error = future.exception()
    if type(error).__name__ == "KilledWorker":
        return _refused(name, "the workers that ran it were lost, one after the other", "lost")
    return _refused(name, f"{type(error).__name__}: {error}", "fault")


def _refused(name: str, reason: str, status: str = "refused") -> _Json:
    return {"name": name, "status": status, "reason": reason, "seconds": 0.0, "peak_memory": 0,
            "worker": "", "fingerprint": ""}  # fmt: skip
