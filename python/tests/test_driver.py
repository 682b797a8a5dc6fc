"""The driver of Dakota and PEST++, and the server of UM-Bridge, give the numbers of the arrays."""

import json
import os
import shutil
import socket
import subprocess
import threading
import urllib.error
import urllib.request
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import bondline
import bondline.umbridge
import numpy as np
import pytest
from bondline.driver import drive, main
from conftest import CASES

PARAMETERS = """\
 2 variables
 1.02 f_k
 0.97 f_cp
 2 functions
 3 ASV_1:peak_BACK
 1 ASV_2:least_sq_term_7
 1 derivative_variables
 2 DVV_1:f_cp
 0 analysis_components
 1 eval_id
"""


def test_dakota_gets_values_and_exact_gradients(slab: bondline.Case) -> None:
    value, residual, gradient = drive(slab, PARAMETERS).splitlines()
    T, dT = slab.tangents([[1.02, 0.97]])
    back = slab.sensors.index("BACK")
    instant = T[0, back].argmax()
    assert value == f"{float(T[0, back, instant])!r} peak_BACK"
    assert residual == f"{float(slab.residuals([1.02, 0.97])[6])!r} least_sq_term_7"
    assert gradient == f"[ {float(dT[0, 1, back, instant])!r} ]"


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        (("3 ASV_1", "4 ASV_1"), "expected no_hessians"),
        (("peak_BACK", "peak_FRONT"), "'peak_FRONT'; expected descriptors such as peak_"),
        (("0.97 f_cp", "0.97 f_cq"), "no factor is called 'f_cq'"),
        (("2 functions", "x functions"), "expected a number and a heading, found 'x functions'"),
        (("1.02 f_k", "nan f_k"), "expected finite numbers"),
        (("2 DVV_1", "0 DVV_1"), "derivatives by variable 0; expected a number from 1 to 2"),
        (("2 DVV_1", "-1 DVV_1"), "derivatives by variable -1; expected a number from 1 to 2"),
        (("2 DVV_1", "3 DVV_1"), "derivatives by variable 3; expected a number from 1 to 2"),
        (("0.97 f_cp", "0.97 f_k"), "'f_k' is stated twice"),
    ],
)
def test_a_wrong_request_of_dakota_is_refused(slab: bondline.Case, changed: tuple[str, str], message: str) -> None:
    with pytest.raises((ValueError, bondline.OptionError), match=message):
        drive(slab, PARAMETERS.replace(*changed))


def test_pest_reads_the_residuals_of_the_case(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    case = bondline.Case.load(CASES / "lamp-test")
    folder = tmp_path / "pest"
    assert main(["--pest", str(folder), str(CASES / "lamp-test")]) == 0
    control = (folder / "bondline.pst").read_text().splitlines()
    data = control.index("* observation data"), control.index("* model command line")
    rows = [line.split() for line in control[data[0] + 1 : data[1]]]
    (tmp_path / "par").write_text("f_k_INS 1.1\n")
    assert main([str(CASES / "lamp-test"), str(tmp_path / "par"), str(tmp_path / "out")]) == 0
    found = dict(line.split() for line in (tmp_path / "out").read_text().splitlines())
    residuals = [(float(found[name]) - float(value)) * float(weight) for name, value, weight, _ in rows]
    point = case.nominal_estimated
    point[case.estimated.index("f_k_INS")] = 1.1
    assert np.allclose(residuals, case.residuals(point), rtol=1e-9, atol=1e-9)
    instructions = (folder / "bondline.ins").read_text().splitlines()[1:]
    assert [line.split("!")[1] for line in instructions] == [name for name, *_ in rows]

    (tmp_path / "par").write_text("f_k_INS many\n")
    assert main([str(CASES / "lamp-test"), str(tmp_path / "par"), str(tmp_path / "out")]) == 1
    assert (tmp_path / "out").read_text() == "FAIL\n"
    assert "expected a name and a number, found 'f_k_INS many'" in capsys.readouterr().err


@pytest.mark.skipif(os.name == "nt", reason="runs a script of a shell")
def test_pest_runs_a_case_whose_path_has_blanks_and_quotes(tmp_path: Path) -> None:
    case = tmp_path / "my 'lamp' test"
    shutil.copytree(CASES / "lamp-test", case)
    folder = tmp_path / "pest"
    assert main(["--pest", str(folder), str(case)]) == 0
    lines = (folder / "bondline.pst").read_text().splitlines()
    command = lines[lines.index("* model command line") + 1]
    (folder / "bondline.par").write_text("f_k_INS 1.1\n")
    # As PEST++ does.
    subprocess.run(command.split(" "), cwd=folder, check=True)
    assert "residual_1 " in (folder / "bondline.out").read_text()


@pytest.fixture
def address(slab: bondline.Case) -> Iterator[str]:
    server = bondline.umbridge.server(slab, port=0)
    assert server.server_address[0] == "127.0.0.1"
    threading.Thread(target=server.serve_forever, daemon=True).start()
    yield f"http://127.0.0.1:{server.server_port}"
    server.shutdown()
    server.server_close()


def post(address: str, path: str, **content: object) -> Any:
    request = urllib.request.Request(address + path, json.dumps(content).encode())
    try:
        with urllib.request.urlopen(request, timeout=30) as answer:
            return json.load(answer)
    except urllib.error.HTTPError as error:
        return json.load(error)


def test_um_bridge_gets_values_gradients_and_jacobians(slab: bondline.Case, address: str) -> None:
    with urllib.request.urlopen(f"{address}/Info", timeout=30) as answer:
        assert json.load(answer) == {"protocolVersion": 1.0, "models": ["peaks", "residuals"]}
    x = [1.02, 0.97]
    residuals, jacobian = slab.residuals(x), slab.jacobian(x)
    assert post(address, "/InputSizes", name="residuals") == {"inputSizes": [2]}
    assert post(address, "/OutputSizes", name="residuals") == {"outputSizes": [len(residuals)]}
    assert post(address, "/Evaluate", name="residuals", input=[x])["output"] == [residuals.tolist()]
    place = {"outWrt": 0, "inWrt": 0, "input": [x], "name": "residuals"}
    gradient = post(address, "/Gradient", sens=residuals.tolist(), **place)["output"]
    assert np.allclose(gradient, residuals @ jacobian)
    assert np.allclose(post(address, "/ApplyJacobian", vec=[0.0, 1.0], **place)["output"], jacobian[:, 1])
    peaks = post(address, "/Evaluate", name="peaks", input=[x])["output"]
    assert peaks == [slab.peaks([x])[0][0].tolist()]


def test_um_bridge_names_what_is_wrong(address: str) -> None:
    wrong: list[tuple[str, dict[str, Any], str]] = [
        ("/Evaluate", {"name": "peak", "input": [[1.0, 1.0]]}, "no model 'peak': expected peaks, residuals"),
        ("/Evaluate", {"name": "peaks", "input": [[1.0]]}, "input: expected 2 finite numbers, found [1.0]"),
        ("/ApplyHessian", {"name": "peaks", "input": [[1.0, 1.0]], "outWrt": 0, "inWrt": 0}, "no /ApplyHessian"),
    ]
    for path, content, message in wrong:
        assert message in post(address, path, **content)["error"]["message"]


def raw(address: str, request: bytes) -> bytes:
    """What the server answers to these bytes."""
    host, port = address.removeprefix("http://").split(":")
    with socket.create_connection((host, int(port)), timeout=30) as connection:
        connection.sendall(request)
        found = b""
        while part := connection.recv(1 << 16):
            found += part
            if b"}}" in found:
                break
    return found


@pytest.mark.parametrize(
    ("body", "message"),
    [
        (b"[" * 100_000, "nested too deeply"),
        (b'{"name": "peaks", "input": [[1e400, 1.0]]}', "expected 2 finite numbers"),
        (b'{"name": "peaks", "input": [[1' + b"0" * 400 + b", 1.0]]}", "too large"),
        (b'{"name": "peaks", "input": [[1' + b"0" * 9000 + b", 1.0]]}", ""),
        (b'{"name": "peaks", "input": ' + b"[" * 900 + b"]" * 900 + b"}", ""),
        (b'{"name": ["peaks"], "input": [[1.0, 1.0]]}', ""),
        (b"{}", "name"),
        (b"\xff\xfe", ""),
        (b"", ""),
    ],
)
def test_um_bridge_answers_whatever_it_is_sent(address: str, body: bytes, message: str) -> None:
    head = f"POST /Evaluate HTTP/1.0\r\nContent-Length: {len(body)}\r\n\r\n".encode()
    found = raw(address, head + body)
    assert b'"error"' in found and message.encode() in found


@pytest.mark.parametrize("length", ["-1", "many", "1" * 5000, str(1 << 40)])
def test_um_bridge_refuses_a_length_that_is_none(address: str, length: str) -> None:
    found = raw(address, f"POST /Evaluate HTTP/1.0\r\nContent-Length: {length}\r\n\r\n".encode())
    assert b" 413 " in found and b"expected at most" in found


@pytest.mark.parametrize("port", ["-1", "65536", "99999999999999999999", "http"])
def test_um_bridge_refuses_a_port_that_is_none(port: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        bondline.umbridge.main(["--port", port, str(CASES / "slab")])
    assert ended.value.code == 2
    assert "argument --port: " in capsys.readouterr().err


def test_um_bridge_says_that_a_port_is_taken(capsys: pytest.CaptureFixture[str]) -> None:
    with socket.create_server(("127.0.0.1", 0)) as other:
        port = str(other.getsockname()[1])
        assert bondline.umbridge.main(["--port", port, str(CASES / "slab")]) == 2
    assert "bondline.umbridge: " in capsys.readouterr().err


def test_um_bridge_answers_others_while_a_client_stops_in_the_middle(
    slab: bondline.Case, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(bondline.umbridge, "TIME_OUT_S", 1.0)
    server = bondline.umbridge.server(slab, port=0)
    threading.Thread(target=server.serve_forever, daemon=True).start()
    address = f"http://127.0.0.1:{server.server_port}"
    with socket.create_connection(("127.0.0.1", server.server_port), timeout=30) as silent:
        silent.sendall(b"POST /Evaluate HTTP/1.0\r\nContent-Length: 100\r\n\r\n{")
        assert "output" in post(address, "/Evaluate", name="peaks", input=[[1.0, 1.0]])
        # The server ends the wait by itself.
        assert silent.recv(1) == b""
    server.shutdown()
    server.server_close()
