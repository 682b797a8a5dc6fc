"""A case as a server of UM-Bridge (Seelinger et al., Journal of Open Source Software 8, 4748, 2023), with derivatives.

    python -m bondline.umbridge CASE [--host 127.0.0.1] [--port 4242]

The model ``residuals`` maps the factors that the case estimates to its residuals, predicted minus measured temperatures
over their standard deviations; the model ``peaks`` maps all factors to the highest temperature of each sensor, K. Both
have one input and one output vector, gradients and Jacobians. The server of the package ``umbridge`` listens on all
interfaces; this one on the loopback interface unless another address is given, as it has no access control.
"""

from __future__ import annotations

import argparse
import json
import sys
import threading
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any

import numpy as np

from bondline import BondlineError, Case
from bondline._case import Array
from bondline.driver import respond

#: Most bytes of a request: the vectors of a case are far shorter.
LARGEST_REQUEST = 1 << 24

#: Longest wait for a part of a request, or for the client to take a part of an answer, s.
TIME_OUT_S = 60.0

#: Longest message about a request, which may be large.
LONGEST_MESSAGE = 1000


@dataclass(frozen=True)
class _Model:
    inputs: int
    outputs: int
    value: Callable[[Array], Array]
    jacobian: Callable[[Array], Array]


def _models(case: Case) -> dict[str, _Model]:
    names = [f"peak_{sensor}" for sensor in case.sensors]

    def peaks(x: Array, by: Sequence[str] = ()) -> list[tuple[float, Array]]:
        found = respond(case, dict(zip(case.factors, x, strict=True)), by)
        return [found[name] for name in names]

    models = {
        "peaks": _Model(
            len(case.factors),
            len(names),
            lambda x: np.array([value for value, _ in peaks(x)]),
            lambda x: np.array([slopes for _, slopes in peaks(x, case.factors)]),
        )
    }
    if case.ndim and case.has_observations:
        outputs = len(case.residuals(case.nominal_estimated))
        models["residuals"] = _Model(case.ndim, outputs, case.residuals, case.jacobian)
    return models


def server(case: Case, host: str = "127.0.0.1", port: int = 4242) -> ThreadingHTTPServer:
    """A server, which listens; ``serve_forever`` answers, and ``shutdown`` ends it from another thread.

    Parameters
    ----------
    case
        The case.
    host
        The address to listen on.
    port
        The port; 0 for any that is free, which ``server_port`` states.
    """
    models, lock = _models(case), threading.Lock()

    class Handler(BaseHTTPRequestHandler):
        timeout = TIME_OUT_S

        def do_GET(self) -> None:
            if self.path == "/Info":
                self._send(200, {"protocolVersion": 1.0, "models": list(models)})
            else:
                self._fail(404, "InvalidInput", f"no {self.path}: expected /Info")

        def do_POST(self) -> None:
            length = self.headers.get("Content-Length", "0")
            if not (length.isdecimal() and len(length) < 20 and int(length) <= LARGEST_REQUEST):
                self.close_connection = True
                self._fail(413, "InvalidInput", f"a request of {length[:20]} bytes: expected at most {LARGEST_REQUEST}")
                return
            status, content = self._answered(self.rfile.read(int(length)))
            # The lock is free again: a client that takes its answer slowly keeps no other waiting.
            self._send(status, content)

        def _answered(self, body: bytes) -> tuple[int, dict[str, Any]]:
            try:
                request = json.loads(body)
                model = models.get(request["name"])
                if model is None:
                    return _error(400, "ModelNotFound", f"no model {request['name']!r}: expected {', '.join(models)}")
                # One march uses all threads.
                with lock:
                    return 200, _answer(model, self.path, request)
            except KeyError as error:
                return _error(400, "InvalidInput", f"missing: {error}")
            except RecursionError:
                return _error(400, "InvalidInput", "the request is nested too deeply: expected vectors of numbers")
            except (TypeError, ValueError, IndexError, OverflowError) as error:
                return _error(400, "InvalidInput", str(error))
            except Exception as error:
                # Whatever fails, the client gets an answer.
                return _error(500, "ModelError", str(error) or type(error).__name__)

        def _fail(self, status: int, kind: str, message: str) -> None:
            self._send(*_error(status, kind, message))

        def _send(self, status: int, content: dict[str, Any]) -> None:
            body = json.dumps(content).encode()
            try:
                self.send_response(status)
                self.send_header("Content-Type", "application/json")
                self.send_header("Content-Length", str(len(body)))
                self.end_headers()
                self.wfile.write(body)
            except OSError:
                # The client has gone, or does not take its answer.
                self.close_connection = True

        def log_message(self, format: str, *args: object) -> None:
            """Nothing: a client makes thousands of requests."""

    return ThreadingHTTPServer((host, port), Handler)


def _error(status: int, kind: str, message: str) -> tuple[int, dict[str, Any]]:
    return status, {"error": {"type": kind, "message": message[:LONGEST_MESSAGE]}}


def _answer(model: _Model, path: str, request: dict[str, Any]) -> dict[str, Any]:
    if path == "/InputSizes":
        return {"inputSizes": [model.inputs]}
    if path == "/OutputSizes":
        return {"outputSizes": [model.outputs]}
    if path == "/ModelInfo":
        return {"support": {"Evaluate": True, "Gradient": True, "ApplyJacobian": True, "ApplyHessian": False}}
    (vector,) = request["input"]
    x = _vector("input", vector, model.inputs)
    if path == "/Evaluate":
        return {"output": [model.value(x).tolist()]}
    if (request["outWrt"], request["inWrt"]) != (0, 0):
        raise ValueError(f"outWrt {request['outWrt']}, inWrt {request['inWrt']}: expected 0, there is one vector")
    if path == "/Gradient":
        return {"output": (_vector("sens", request["sens"], model.outputs) @ model.jacobian(x)).tolist()}
    if path == "/ApplyJacobian":
        return {"output": (model.jacobian(x) @ _vector("vec", request["vec"], model.inputs)).tolist()}
    raise ValueError(f"no {path}: expected /Evaluate, /Gradient or /ApplyJacobian")


def _vector(name: str, values: Any, length: int) -> Array:
    found = np.array(values, dtype=np.float64)
    if found.shape != (length,) or not np.isfinite(found).all():
        raise ValueError(f"{name}: expected {length} finite numbers, found {values}")
    return found


def main(words: Sequence[str] | None = None) -> int:
    """Serve a case until Ctrl-C, and return the exit code."""
    parser = argparse.ArgumentParser("python -m bondline.umbridge", description="A case as a server of UM-Bridge.")
    parser.add_argument("case", help="case file, or folder with a case.toml")
    parser.add_argument("--host", default="127.0.0.1", help="address to listen on [default: 127.0.0.1]")
    parser.add_argument("--port", type=int, default=4242, help="port to listen on [default: 4242]")
    given = parser.parse_args(words)
    if not 0 <= given.port < 1 << 16:
        parser.error(f"argument --port: expected 0 to 65535, found {given.port}")
    try:
        found = server(Case.load(given.case), given.host, given.port)
    except (BondlineError, OSError) as error:
        print(f"bondline.umbridge: {error}", file=sys.stderr)
        return 2
    print(f"http://{given.host}:{found.server_port}", flush=True)
    try:
        found.serve_forever()
    except KeyboardInterrupt:
        pass
    return 0


if __name__ == "__main__":
    sys.exit(main())
