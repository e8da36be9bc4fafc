#!/usr/bin/env python3
"""A running deployment, watched and commanded from Python over its control socket (docs/control-socket.md).

    davit deploy deployments/youbot_arm.yaml --detach
    python3 examples/control_socket.py youbot_arm e_5dof

Prints the status, raises the event given (if one is), and then shows what happens for a while.
Only the standard library is used: the protocol is one JSON object a line.
"""

import argparse
import json
import os
import socket
import sys
import tempfile
import time


def socket_path(name):
    runtime = os.environ.get("XDG_RUNTIME_DIR")
    if runtime:
        return os.path.join(runtime, "davit", f"{name}.sock")
    return os.path.join(tempfile.gettempdir(), f"davit-{os.getuid()}", f"{name}.sock")


class Deployment:
    """One connection. Notifications that arrive while an answer is awaited are kept for `listen`."""

    def __init__(self, name):
        self.socket = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        self.socket.settimeout(30)
        self.socket.connect(socket_path(name))
        self.lines = self.socket.makefile("r", encoding="utf-8")
        self.next_id = 0
        self.waiting = []

    def call(self, method, **params):
        self.next_id += 1
        request = {"jsonrpc": "2.0", "id": self.next_id, "method": method, "params": params}
        self.socket.sendall((json.dumps(request) + "\n").encode())
        while True:
            message = self.read()
            if message.get("id") != self.next_id:
                self.waiting.append(message)
            elif "error" in message:
                raise RuntimeError(message["error"]["message"])
            else:
                return message["result"]

    def read(self):
        line = self.lines.readline()
        if not line:
            raise EOFError("the deployment closed the connection")
        return json.loads(line)

    def listen(self, seconds):
        """Yields notifications for so many seconds."""
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            if self.waiting:
                yield self.waiting.pop(0)
                continue
            self.socket.settimeout(max(0.01, end - time.monotonic()))
            try:
                yield self.read()
            except (TimeoutError, EOFError, OSError):
                return


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("name", help="the deployment's name")
    parser.add_argument("event", nargs="?", help="an event to raise")
    parser.add_argument("--listen", type=float, default=1.0, help="for how many seconds (default 1)")
    arguments = parser.parse_args()

    try:
        deployment = Deployment(arguments.name)
    except OSError as error:
        sys.exit(f"no deployment named {arguments.name} is running ({error.strerror})")

    status = deployment.call("status")
    print(f"{status['name']}: {status['phase']}, {len(status['system']['components'])} components")
    print("coordinator:", status["coordinator"][-1] if status["coordinator"] else "inactive")
    print("stack:", ", ".join(frame["configuration"] for frame in status["stack"]) or "empty")

    deployment.call("subscribe")
    if arguments.event:
        deployment.call("event", event=arguments.event)
    for notification in deployment.listen(arguments.listen):
        entry = notification["params"]
        print(f"{entry['at']:10.3f}  {entry['what']:<10}", json.dumps({k: v for k, v in entry.items() if k not in ("at", "what")}))


if __name__ == "__main__":
    main()
