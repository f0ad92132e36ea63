"""What is required of cohorts, as rows of `reports/evidence/cohort.csv`.

All but `kills` and `planning` say something only on a machine that does nothing else. `kills` with
real studies takes an hour. Studies are kept in --work, and begin anew with each call.
"""

import json
import os
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
from argparse import Namespace
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from types import SimpleNamespace
from typing import Any, Final

import evidence
from evidence import ROOT, option
from evidence.marked_table import with_table
from gaitval.apps.cohort import cluster, task
from gaitval.apps.cohort.engine import outcomes_of, run_cohort
from gaitval.apps.cohort.identity import REAL, fingerprint
from gaitval.apps.cohort.store import FINISHED, SUMMARY, Store
from gaitval.apps.cohort.table import Study
from gaitval.datasets.subject_file import load_subject
from gaitval.study.stage import Observer

sys.path.insert(0, str(ROOT / "tests" / "support"))  # it is no package: pytest finds it so too

import quick_study
from killed_cohort import environment, killed, quick, results

REAL_ONES: Final = option("--real", action="store_true", help="real studies, not made-up ones")
SET: Final = option("--set", dest="settings", action="append", default=[], help="of the studies")
WORK: Final = option("--work", type=Path, default=Path(tempfile.gettempdir()) / "gaitval-cohort",
                     help="folder of the studies (default: %(default)s)")  # fmt: skip
PAGE: Final = ROOT / "docs" / "how-to" / "cohort.md"
KILLS: Final = 10
SINGLE: Final = ("5", "8", "1", "10")
"""Subjects of the studies that are run singly and side by side."""
PLANNED: Final = 10_000
STUDY_SECONDS: Final = 90.0
"""The goal for one study (a new subject, general policy to report), for the plan."""
LATENCIES: Final = (0.0, 0.01)
"""s, added to every message between scheduler, workers and client: none, and a slow network."""
MEASURES = {
    "studies complete with *": {"code": ("@cohort", "evidence/cohort/studies.py:kills,KILLS")},
    "processes of studies left *": {"code": ("@cohort", "evidence/cohort/studies.py:kills,KILLS")},
    "efficiency * (computing of 10 s)": {
        "code": ("@cohort", "evidence/cohort/studies.py:efficiency,busy"),
        "allowed": 30,
        "why": "what takes time between two studies is Dask; of ours it is a few calls for each",
    },
    "*": {
        "code": ("@study", "@cohort", "evidence/cohort/studies.py:trials,efficiency"),
        "allowed": 60,
        "why": "as evidence/cohort/speed.py: less than two runs differ",
    },
}
"""What the rows depend on; see evidence/stale.py."""


def ready(arguments: Namespace) -> Path:
    """The folder of the studies, empty; processes of this one find what the tests share."""
    shutil.rmtree(arguments.work, ignore_errors=True)
    arguments.work.mkdir(parents=True)
    os.environ["PYTHONPATH"] = environment()["PYTHONPATH"]
    return Path(arguments.work)


@evidence.measurement(
    REAL_ONES, SET, WORK, option("--kills", type=int, default=KILLS),
    option("--seed", type=int, default=0),
)  # fmt: skip
def kills(arguments: Namespace) -> list[evidence.Row]:
    """A cohort that is killed, against one that is not."""
    work = ready(arguments)
    if arguments.real:
        table = work / "table.csv"
        table.write_text("subject,start\n" + "".join(f"{each},general\n" for each in SINGLE))
        options = ["--retries=20", *(f"--set={each}" for each in arguments.settings)]
        line = [sys.executable, "-m", "gaitval", "cohort", str(table), *options]
        broken = [*line, f"--out={work / 'broken'}"]
        names, folder, pause = list(SINGLE), work / "broken" / "studies", 40.0
    else:
        names = [f"study{number}_sleep4" for number in range(24)]
        broken, folder, pause = quick(work / "broken", "2", names), work / "broken", 4.0
    found = killed(
        broken, folder, kills=arguments.kills, seed=arguments.seed, pause=pause, limit=36_000.0
    )
    print(json.dumps({**found, "told": found["told"][-300:]}), flush=True)
    now = {name: json.loads(text) for name, text in results(folder).items()}
    if arguments.real:
        whole = [*line, f"--out={work / 'whole'}"]
        subprocess.run(whole, env=environment(), check=True, stdout=subprocess.DEVNULL)
        texts = results(work / "whole" / "studies")
        wanted = {name: json.loads(text) for name, text in texts.items()}
    else:
        with ThreadPoolExecutor(len(names)) as pool:
            wanted = dict(zip(names, pool.map(lambda name: _alone(work, name), names), strict=True))
    equal = [name for name in wanted if now.get(name) == wanted[name]]
    if len(wanted) != len(names) or found["kills"] != arguments.kills or not found["halfway"]:
        raise SystemExit(f"the run says nothing: {len(wanted)} studies, {found}")
    kind = "real studies" if arguments.real else "studies of 4 s"
    return [
        evidence.Row(
            f"studies complete with equal results after {arguments.kills} kills of workers and one "
            f"of the scheduler ({kind})",
            100.0 * len(equal) / len(names), "%", ">=", 100, 100, len(names),
        ),
        evidence.none_may(
            f"processes of studies left by the scheduler's end ({kind})",
            found["left"], "1", 1,
        ),
    ]  # fmt: skip


def _alone(work: Path, name: str) -> dict[str, Any]:
    """The summary of a quick study that nothing happens to."""
    folder = work / "alone" / name
    folder.mkdir(parents=True)
    found = quick_study.work(SimpleNamespace(name=name), folder, 1, Observer())
    return dict(json.loads(json.dumps(found)))


@evidence.measurement(evidence.DATA, SET, WORK)
def trials(arguments: Namespace) -> list[evidence.Row]:
    """Every trial there is as a cohort, by the command: its wall time, and memory of a study."""
    out = ready(arguments) / "trials"
    command = [sys.executable, "-m", "gaitval", "cohort", f"--all-data={arguments.data}",
               f"--out={out}", *(f"--set={each}" for each in arguments.settings)]  # fmt: skip
    began = time.monotonic()
    subprocess.run(command, env=environment(), check=True)
    minutes = (time.monotonic() - began) / 60.0
    store = Store(str(out / "studies"))
    found = [store.finished(path.name) for path in sorted((out / "studies").iterdir())]
    done = [each for each in found if each]
    if len(done) != 15:
        raise SystemExit(f"{len(done)} studies finished, not 15: is {arguments.data} complete?")
    peak = max(each["peak_memory"] for each in done) / 1e9
    print(json.dumps({each["name"]: [each["seconds"], each["peak_memory"]] for each in done}))
    return [
        evidence.Row("15 real trials as a cohort", minutes, "min", "<=", 25, 45, 15),
        evidence.Row("memory of a study, largest", peak, "GB", "<=", 1, 1.5, 15),
    ]


@evidence.measurement(
    REAL_ONES, SET, WORK, option("--subjects", nargs="+", default=list(SINGLE)),
)  # fmt: skip
def efficiency(arguments: Namespace) -> list[evidence.Row]:
    """Two workers against the sum of single studies: each alone on the machine, in a cohort of one
    worker, with the same settings and threads.
    """
    ready(arguments)
    function = REAL if arguments.real else f"{__name__}:{busy.__name__}"
    settings = tuple(arguments.settings)
    studies = [
        Study(name=f"study{each}", subject=each, start="general", settings=settings)
        for each in arguments.subjects
    ]

    def timed(workers: int, chosen: list[Study], name: str) -> float:
        outcomes = run_cohort(
            chosen, str(arguments.work / name), workers=workers, function=function
        )
        if any(each["status"] != "finished" for each in outcomes):
            raise SystemExit(f"a study failed: {outcomes}")
        ends = [(arguments.work / name / study.name / FINISHED).stat().st_mtime for study in chosen]
        begins = [
            end - each["seconds"] for end, each in zip(ends, outcomes, strict=True)
        ]  # the start of Dask itself is not of the studies
        return max(ends) - min(begins)

    single = [timed(1, [study], f"single-{study.name}") for study in studies]
    together = timed(2, studies, "together")
    value = sum(single) / (2 * together)
    print(f"single {[round(each, 1) for each in single]} s, together {together:.1f} s")
    kind = "real studies" if arguments.real else "computing of 10 s"
    return [
        evidence.Row(
            f"efficiency of 2 workers against the sum of single studies ({kind})",
            value, "1", ">=", 0.95, 0.9, len(studies),
        )
    ]  # fmt: skip


def busy(study: Study, folder: Path, threads: int, observer: Observer) -> dict[str, Any]:
    """A study that computes for 10 s of processor time in one thread."""
    number, end = 1, time.process_time() + 10.0
    while time.process_time() < end:
        number = number * 48271 % 2147483647
    return quick_study.summary(study.name, "00000001", 1.0, threads)


@evidence.measurement(
    WORK, option("--studies", type=int, default=400, help="so many tiny ones")
)  # fmt: skip
def planning(arguments: Namespace) -> list[evidence.Row]:
    """Tiny studies on 2, 4 and 8 workers, with latency: what 10,000 studies would be limited by.

    Writes the table of the page. These are figures of a design, so there is no row of evidence.
    """
    ready(arguments)
    lines = ["| workers | latency of a message | studies/s | messages a study | scheduler, "
             "processor time a study |", "|---|---|---|---|---|"]  # fmt: skip
    rates: dict[tuple[int, float], float] = {}
    costs: list[float] = []
    for workers in (2, 4, 8):
        for latency in LATENCIES:
            found = _throughput(arguments.work, workers, latency, arguments.studies)
            rates[workers, latency] = found["rate"]
            costs.append(found["processor"])
            lines.append(
                f"| {workers} | {1000 * latency:g} ms | {found['rate']:.0f} | "
                f"{found['messages']:.1f} | {1000 * found['processor']:.1f} ms |"
            )
            print(lines[-1], flush=True)
    sizes = _sizes(arguments.work)
    lines += ["", *_plan(statistics.median(costs), sizes)]
    text = PAGE.read_text(encoding="utf-8")
    PAGE.write_text(with_table(text, "planning", "\n".join(lines)), encoding="utf-8")
    print("\n".join(lines))
    return []


def _throughput(work: Path, workers: int, latency: float, count: int) -> dict[str, float]:
    """Orders a second of studies that take no time, messages and processor time of each.

    Scheduler and client are this process, as in a cohort of this machine; the workers are others.
    The processor time is of scheduler and client together.
    """
    import dask
    from distributed import Client, LocalCluster

    sent = {"count": 0}
    orders = [
        task.order_of({"name": f"s{n}", "subject": "5"}, f"{n:064x}", str(work / "none"),
                      function="none", threads=1)
        for n in range(count)
    ]  # fmt: skip
    quiet = dask.config.set(cluster.QUIET)
    made = LocalCluster(
        n_workers=workers,
        threads_per_worker=1,
        host=cluster.LOOPBACK,
        dashboard_address=None,
        memory_limit=0,
    )
    with quiet, made, Client(made) as client:
        client.wait_for_workers(workers)
        client.run(_slow_messages, latency)
        counted = _counted_messages(sent, latency)
        with counted:
            task.answer, real = _tiny, task.answer
            began, used = time.monotonic(), time.process_time()
            try:
                done = sum(each is not None for each in outcomes_of(client, orders, 0))
            finally:
                task.answer = real
            seconds, used = time.monotonic() - began, time.process_time() - used
    if done != count:
        raise SystemExit(f"{done} of {count} orders done")
    return {"rate": count / seconds, "messages": sent["count"] / count, "processor": used / count}


def _tiny(order: dict[str, Any]) -> str:
    """What `task.answer` returns, at once."""
    return json.dumps(
        {"name": order["study"]["name"], "fingerprint": order["fingerprint"], "worker": "here:1",
         "status": "finished", "reason": "", "seconds": 0.0, "peak_memory": 0}
    )  # fmt: skip


class _counted_messages:
    """Counts what scheduler and client send, and makes each message late."""

    def __init__(self, sent: dict[str, int], latency: float) -> None:
        self.sent, self.latency = sent, latency

    def __enter__(self) -> None:
        from distributed.comm.tcp import TCP

        self.real = TCP.write
        TCP.write = _late(self.real, self.latency, self.sent)

    def __exit__(self, *_: object) -> None:
        from distributed.comm.tcp import TCP

        TCP.write = self.real


def _late(write: Any, latency: float, sent: dict[str, int]) -> Any:
    async def late(self: Any, *arguments: Any, **options: Any) -> Any:
        import asyncio

        sent["count"] += 1
        if latency:
            await asyncio.sleep(latency)
        return await write(self, *arguments, **options)

    return late


def _slow_messages(latency: float) -> None:
    """On a worker: make each message late."""
    from distributed.comm.tcp import TCP

    TCP.write = _late(TCP.write, latency, {"count": 0})


def _sizes(work: Path) -> dict[str, float]:
    """Bytes of what a study sends and leaves, and seconds of reading a summary."""
    from gaitval.apps.cohort.study import summary_of
    from gaitval.artefacts import write_json

    baseline = ROOT / "reports" / "S05" / "baseline"
    metrics = json.loads((baseline / "metrics.json").read_text())
    folder = work / "sizes" / "a"
    write_json(folder / SUMMARY, summary_of(metrics, load_subject(5)))
    order = task.order_of({"name": "S05-T05", "subject": "5"}, "0" * 64, "/shared/cohort/studies",
                          function=REAL, threads=1)  # fmt: skip
    store, began = Store(str(work / "sizes")), time.perf_counter()
    for _ in range(100):
        store.read("a", SUMMARY)
    return {
        "order": len(json.dumps(order)),
        "outcome": len(json.dumps(_tiny(order))),
        "summary": (folder / SUMMARY).stat().st_size,
        "metrics": (baseline / "metrics.json").stat().st_size,
        "read": (time.perf_counter() - began) / 100,
        "fingerprint": _fingerprint_seconds(work),
    }


def _fingerprint_seconds(work: Path) -> float:
    """Processor time of the fingerprint of a study whose subject file nobody has read before, s."""
    fingerprint(Study(name="first", subject="5"))  # loads what is hashed
    text, names = load_subject(6).to_toml(), [str(work / f"s{n}.toml") for n in range(10)]
    for name in names:
        Path(name).write_text(text, encoding="utf-8")
    began = time.process_time()
    for name in names:
        fingerprint(Study(name="any", subject=name))
    return (time.process_time() - began) / len(names)


def _plan(processor: float, sizes: dict[str, float]) -> list[str]:
    """What limits 10,000 studies, in words with the figures."""
    most = float(f"{STUDY_SECONDS / processor:.2g}")
    summaries = PLANNED * sizes["summary"] / 1e6
    metrics = PLANNED * sizes["metrics"] / 1e9
    return [
        f"* **Scheduler.** {1000 * processor:.1f} ms of one processor a study: {PLANNED:,} studies "
        f"cost it {PLANNED * processor / 60:.1f} min in all. With studies of {STUDY_SECONDS:g} s "
        f"it is busy all the time from about {most:,.0f} workers on; half as many is a sound plan.",
        f"* **Messages.** An order is {sizes['order']:.0f} bytes and an outcome "
        f"{sizes['outcome']:.0f}: {PLANNED * (sizes['order'] + sizes['outcome']) / 1e6:.0f} MB for "
        f"{PLANNED:,} studies. Curves, policies and reports never go through the scheduler.",
        f"* **Results.** The report reads a summary of {sizes['summary'] / 1e3:.0f} kB a study, "
        f"{summaries:.0f} MB in all and {PLANNED * sizes['read']:.0f} s from a local disk; with 10 "
        f"ms for each file of a network's, {PLANNED * 0.01 / 60:.1f} min more. Reading "
        f"`metrics.json` instead would be {metrics:.1f} GB.",
        f"* **Start.** Before anything runs, the command hashes what each study depends on: "
        f"{1000 * sizes['fingerprint']:.0f} ms for a subject file, "
        f"{PLANNED * sizes['fingerprint'] / 60:.0f} min for {PLANNED:,} of them; a subject that "
        "several studies share is read once.",
        f"* **Time.** {PLANNED:,} studies of {STUDY_SECONDS:g} s are "
        f"{PLANNED * STUDY_SECONDS / 3600:.0f} h of a processor: "
        f"{PLANNED * STUDY_SECONDS / 3600 / 100:.1f} h on 100 workers.",
    ]
