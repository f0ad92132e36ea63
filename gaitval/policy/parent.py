"""Worker processes that end with the process that started them, however that ends."""

import multiprocessing as mp
import os
import threading


def end_with_parent() -> None:
    """End this worker process as soon as the one that started it has ended.

    A worker that waits for work never sees that nobody is left to give any, because it has both
    ends of the queue. The watch is a thread that waits on the parent's end, which every system
    tells; Linux's signal at a parent's death would come from the end of a thread too.
    """
    parent = mp.parent_process()
    if parent is None:
        return

    def watch() -> None:
        parent.join()
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()
