"""`tvist keys`, and `tvist serve` with and without keys."""

import json
import re
import socket
import subprocess
import sys
from datetime import timedelta
from pathlib import Path

import pytest
from cryptography import x509
from cryptography.x509.oid import ExtendedKeyUsageOID
from tests import forked
from tests.conformance.served import Served, finished, free_endpoint
from tests.conformance.wire import PATIENCE

from tvist_client.__main__ import main as check_alone

from .keyring import forge, free_tls_endpoint, made
from .shell import begun, tvist
from .test_wrong_invocations import assert_said

ROOT = Path(__file__).parents[2]


@pytest.fixture
def ring(tmp_path):
    return made(tmp_path / "ring", "--operator", "anna", "--viewer", "wall")


def content(folder):
    return {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}


class TestMaking:
    def test_robot_and_each_client_get_keys_that_only_their_owner_can_read(self, ring):
        of_a_client = ("authority.pem", "client.pem", "client.key")
        clients = {f"{who}/{name}" for who in ("anna", "wall") for name in of_a_client}
        names = {str(path.relative_to(ring)) for path in content(ring)}
        assert names == {"authority.pem", "authority.key", "robot.pem", "robot.key", "clients.toml"} | clients
        assert (ring / "anna" / "authority.pem").read_bytes() == (ring / "authority.pem").read_bytes()
        assert {key.stat().st_mode & 0o777 for key in ring.rglob("*.key")} == {0o600}
        assert {(ring / who).stat().st_mode & 0o777 for who in ("anna", "wall")} == {0o700}

    def test_certificates_have_their_usage_and_validity(self, tmp_path):
        ring = made(tmp_path / "ring", "--operator", "anna", "--days", "30")
        texts = ((ring / name).read_bytes() for name in ("robot.pem", "anna/client.pem"))
        robot, anna = map(x509.load_pem_x509_certificate, texts)
        names = robot.extensions.get_extension_for_class(x509.SubjectAlternativeName).value
        assert [str(name.value) for name in names] == ["127.0.0.1", "localhost"]
        uses = ((robot, ExtendedKeyUsageOID.SERVER_AUTH), (anna, ExtendedKeyUsageOID.CLIENT_AUTH))
        for certificate, usage in uses:
            extension = certificate.extensions.get_extension_for_class(x509.ExtendedKeyUsage)
            assert list(extension.value) == [usage]
            lasts = certificate.not_valid_after_utc - certificate.not_valid_before_utc
            assert lasts == timedelta(days=30, hours=1)
        assert anna.subject.rfc4514_string() == "CN=anna"

    def test_second_call_adds_clients_and_overwrites_nothing(self, ring, called):
        before = content(ring)
        said = called("keys", ring, "--operator", "anna", "--viewer", "otto", "--json").assert_done().json
        assert said["roles"] == {"anna": "operator", "wall": "viewer", "otto": "viewer"}
        after = content(ring)
        assert {path for path in before if before[path] != after[path]} == {ring / "clients.toml"}
        assert (ring / "otto" / "authority.pem").read_bytes() == (ring / "authority.pem").read_bytes()

    @pytest.mark.parametrize(
        ("options", "code", "words"),
        [
            ("--operator wall", 1, ["wall already has the role viewer"]),
            ("--robot other --host localhost", 1, ["robot.pem belongs to ur5e", "not overwritten"]),
            ("--robot ur5e --host elsewhere", 1, ["belongs to ur5e at 127.0.0.1, localhost"]),
            ("--viewer ../etc", 2, ["client is '../etc'"]),
            ("--viewer authority.pem", 2, ["client is 'authority.pem'"]),
            ("--viewer a --operator a", 2, ["cannot be both operator and viewer"]),
            ("--host 999.1.1.1", 2, ["host is '999.1.1.1'"]),
            ("--robot UR-5", 2, ["robot is 'UR-5'"]),
            ("--days 0", 2, ["days is 0", "1 to 3650"]),
        ],
    )
    def test_invalid_options_are_refused_and_change_nothing(self, ring, called, options, code, words):
        before = content(ring)
        assert_said(called("keys", str(ring), "--viewer", "otto", *options.split()), code, words)
        assert content(ring) == before

    def test_first_call_needs_robot_and_host(self, called, tmp_path):
        assert_said(called("keys", "ring", "--operator", "anna"), 2, ["--robot", "--host"])
        assert not (tmp_path / "ring").exists()

    def test_missing_key_of_the_authority_is_refused(self, ring, called):
        (ring / "authority.key").unlink()
        before = content(ring)
        assert_said(called("keys", str(ring), "--viewer", "otto"), 1, ["authority.key", "put it back"])
        assert content(ring) == before

    def test_revoked_name_is_refused_and_a_moved_folder_is_made_again(self, ring, called):
        (ring / "anna").rename(ring.parent / "old")
        (ring / "clients.toml").write_text('"anna" = "operator"\n')
        before = content(ring)
        assert_said(called("keys", str(ring), "--operator", "wall"), 1, ["wall", "use another name"])
        assert content(ring) == before
        assert called("keys", str(ring), "--operator", "anna")[0] == 0
        old, new = (folder / "client.pem" for folder in (ring.parent / "old", ring / "anna"))
        assert new.read_bytes() != old.read_bytes()
        assert (ring / "clients.toml").read_text().count("anna") == 1


class TestServing:
    @pytest.mark.realtime
    def test_insecure_server_warns_that_anyone_can_move_the_robot(self):
        endpoint = free_endpoint().replace("127.0.0.1", "0.0.0.0")  # noqa: S104  that is the point
        with Served("--clock", "lockstep", "--insecure", endpoint=endpoint) as served:
            assert f"anyone who can reach {endpoint} can move this robot" in served.said
            with socket.create_connection(("127.0.0.1", int(endpoint.rpartition(":")[2]))):
                pass

    @pytest.mark.parametrize(
        ("endpoint", "options", "words"),
        [
            ("tcp/127.0.0.1:7447", (), ["tcp/127.0.0.1:7447", "tls/127.0.0.1:7447"]),
            ("tls/127.0.0.1:7447#enable_mtls=false", (), ["tls/127.0.0.1:7447#enable_mtls=false", "#"]),
            ("tls/127.0.0.1:7447", ("--insecure",), ["security and insecure"]),
        ],
    )
    def test_what_contradicts_security_is_refused(self, ring, called, endpoint, options, words):
        assert_said(called("serve", "--listen", endpoint, "--security", str(ring), *options), 2, words)

    def serve(self, called, ring):
        return called("serve", "--listen", free_tls_endpoint(), "--security", str(ring))

    @pytest.mark.parametrize(
        ("name", "spoilt"),
        [("authority.pem", None), ("robot.pem", b"nonsense"), ("robot.key", b""), ("clients.toml", None)],
    )
    def test_missing_or_damaged_key_file_is_refused(self, ring, called, name, spoilt):
        (ring / name).unlink()
        if spoilt is not None:
            (ring / name).write_bytes(spoilt)
        assert_said(self.serve(called, ring), 2, [str(ring)])

    def test_expired_certificate_and_one_of_another_authority_are_refused(self, ring, called, tmp_path):
        issuer = (ring / "authority.pem", ring / "authority.key")
        usage = ExtendedKeyUsageOID.SERVER_AUTH
        expired = forge(tmp_path / "expired", "ur5e", issuer=issuer, days=-1, usage=usage)
        other = made(tmp_path / "other", "--operator", "anna")
        for files, said in ((expired / "client", "expired"), (other / "robot", "no client would trust")):
            for what in (".pem", ".key"):
                (ring / f"robot{what}").write_bytes(files.with_suffix(what).read_bytes())
            assert_said(self.serve(called, ring), 2, [said])

    def test_port_in_use_is_reported_without_internal_settings(self, ring, called):
        with socket.create_server(("127.0.0.1", 0)) as taken:
            endpoint = f"tls/127.0.0.1:{taken.getsockname()[1]}"
            ended = called("serve", "--listen", endpoint, "--security", str(ring))
        assert_said(ended, 1, [f"cannot listen on {endpoint}: the port is in use"])


class TestProgram:
    @pytest.fixture(scope="class")
    @classmethod
    def robot(cls, tmp_path_factory):
        """A robot in lockstep, which no busy machine overloads."""
        ring = made(tmp_path_factory.mktemp("keys") / "ring", "--operator", "anna", "--viewer", "wall")
        options = ("--security", str(ring), "--clock", "lockstep")
        with Served(*options, endpoint=free_tls_endpoint()) as served:
            yield served.endpoint, ring

    @pytest.mark.parametrize(("name", "said"), [("anna", "no_control"), ("wall", "the role viewer")])
    def test_operator_and_viewer_check_the_robot(self, robot, name, said, capsys):
        endpoint, ring = robot
        assert said in tvist("check", endpoint, "--security", ring / name).assert_done().out
        assert check_alone(["check", endpoint, "--security", str(ring / name)]) == 0
        assert said in capsys.readouterr().out

    def test_operator_moves_the_robot_and_viewer_may_not(self, robot, called):
        endpoint, ring = robot
        near, commands = "0.05,-3.1,0,-1.6,0,0", (("move", "Q1", "--endpoint"), ("identify",))
        tvist("move", near, "--endpoint", endpoint, "--security", ring / "anna").assert_done()
        for command in commands:
            ended = called(*command, endpoint, "--security", str(ring / "wall"))
            assert_said(ended, 1, ["may only watch: use an operator's certificate"])

    def test_viewer_watches_and_records(self, robot, tmp_path):
        endpoint, ring = robot
        wall = ("--security", ring / "wall")
        with begun("watch", endpoint, *wall, "--json") as watching:
            assert json.loads(watching.stdout.readline())["type"] == "state"
        file = tmp_path / "seen.mcap"
        tvist("log", "record", file, "--endpoint", endpoint, *wall, "--seconds", "0.1").assert_done()
        assert file.stat().st_size > 1000


def test_commands_of_the_how_to_work_in_their_order(tmp_path):
    """The robot is served in lockstep."""
    text = (ROOT / "docs" / "how-to" / "secure-a-robot.md").read_text(encoding="utf-8")
    blocks = re.findall(r"```sh\n(.*?)```", text, re.DOTALL)
    commands = [line.partition("  #")[0] for block in blocks for line in block.splitlines() if line]
    port = free_endpoint().rpartition(":")[2]
    serving, ran = None, 0
    try:
        for command in commands:
            first, *words = command.replace("7447", port).replace("robot.lab", "localhost").split()
            assert first in {"tvist", "python"}, command
            words = ["-m", "tvist_cli", *words] if first == "tvist" else words
            if "serve" in words:
                words = [sys.executable, *words, "--clock", "lockstep"]
                serving = forked.Popen(words, cwd=tmp_path, stderr=subprocess.PIPE, text=True)
                assert any("listens on" in line for line in serving.stderr)
                continue
            ended = finished(*words, cwd=tmp_path)
            assert ended.returncode == 0, (command, ended.stderr)
            ran += 1
    finally:
        if serving is not None:
            serving.terminate()
            serving.communicate(timeout=PATIENCE)
    assert ran > 4
