"""The inspector as a page that browsers open: address, port, and an orderly end."""

from __future__ import annotations

import logging
import os
import socket
import sys
from collections.abc import Callable

from gui.inspector import Inspector
from lab import LabError

LOOPBACK = "127.0.0.1"
PORT = 8642
_NOISY = ("wslink", "aiohttp", "asyncio")
"""They write pages of traceback when a browser is closed while something is sent to it, which is no error."""
_LOOPBACKS = ("localhost", "127.", "::1")


def serve(app: Inspector, host: str = LOOPBACK, port: int | None = None, tell: Callable[[str], None] = print) -> None:
    """Serves `app` until it is interrupted; `tell` hears the address as soon as it answers.

    Args:
        app: the inspector.
        host: where to listen. Anything but loopback opens the inspector to others, which `tell` is warned of.
        port: None: :data:`PORT`, or a free one where that is taken; 0: any free one.
        tell: called with what the user should read.

    Errors: :class:`lab.LabError` where the host is unknown or the port is taken.
    """
    chosen = free_port(host, port)
    # The server library would read the command line of this program, and write on its standard output.
    os.environ["TRAME_ARGS"] = "--server"
    os.environ["WSLINK_READY_MSG"] = ""

    def ready(**_: object) -> None:
        shown = f"[{host}]" if ":" in host else host
        tell(f"inspector: http://{shown}:{app.server.port}/  (Ctrl-C ends it)")
        if not host.startswith(_LOOPBACKS):
            tell(f"warning: whoever can reach {host} can use this inspector; there is no password")
        sys.stdout.flush()

    for name in _NOISY:
        logging.getLogger(name).setLevel(logging.CRITICAL)
    app.ctrl.on_server_ready.add(ready)
    app.server.start(
        host=host, port=chosen, open_browser=False, show_connection_info=False, disable_logging=True, timeout=0
    )


def free_port(host: str, port: int | None) -> int:
    """The port to listen at, tried out: `port`, or with None :data:`PORT` or a free one."""
    for candidate in [PORT, 0] if port is None else [port]:
        try:
            return _bind(host, candidate)
        except OSError as error:
            if port is None and candidate:
                continue
            if isinstance(error, socket.gaierror) or not port:
                raise LabError(f"--host {host}: can't be listened at ({error.strerror or error})") from None
            reason = error.strerror or str(error)
            raise LabError(f"--port {port}: {reason.lower()}; choose another, or 0 for any free one") from None
    raise AssertionError("the last candidate either works or raises")


def _bind(host: str, port: int) -> int:
    family, kind, protocol, _, address = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)[0]
    with socket.socket(family, kind, protocol) as listener:
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        listener.bind(address)
        return int(listener.getsockname()[1])
