"""`tvist keys`, and `tvist serve` with what it made, or without."""

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
from tests.conformance.served import Served, free_endpoint
from tests.conformance.wire import PATIENCE

from tvist_client.__main__ import main as check_alone

from .keyring import forge, free_tls_endpoint, made, mode, tvist

ROOT = Path(__file__).parents[2]


@pytest.fixture
def ring(tmp_path):
    return made(tmp_path / "ring", "--operator", "anna", "--viewer", "wall")


def failed(ended, code, *words):
    """What was said on the way out, in one sentence in which these words stand."""
    assert ended.returncode == code, ended.stderr
    assert ended.stdout == ""
    assert ended.stderr.startswith("tvist: ")
    assert ended.stderr.count("\n") == 1, ended.stderr
    assert all(word in ended.stderr for word in words), ended.stderr


def content(folder):
    return {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}


class TestMaking:
    def test_a_folder_for_the_robot_and_one_for_each_client(self, ring):
        names = {str(path.relative_to(ring)) for path in content(ring)}
        clients = {
            f"{who}/{name}"
            for who in ("anna", "wall")
            for name in ("authority.pem", "client.pem", "client.key")
        }
        assert names == {"authority.pem", "authority.key", "robot.pem", "robot.key", "clients.toml"} | clients
        assert (ring / "anna" / "authority.pem").read_bytes() == (ring / "authority.pem").read_bytes()

    def test_private_keys_are_for_their_owner_alone(self, ring):
        keys = list(ring.rglob("*.key"))
        assert len(keys) == 4
        assert {mode(key) for key in keys} == {0o600}
        assert {mode(ring / who) for who in ("anna", "wall")} == {0o700}

    def test_certificates_say_what_they_are_for_and_for_how_long(self, tmp_path):
        ring = made(tmp_path / "ring", "--operator", "anna", "--days", "30")
        robot, anna = (
            x509.load_pem_x509_certificate((ring / name).read_bytes())
            for name in ("robot.pem", "anna/client.pem")
        )
        names = robot.extensions.get_extension_for_class(x509.SubjectAlternativeName).value
        assert [str(name.value) for name in names] == ["127.0.0.1", "localhost"]
        for certificate, usage in (
            (robot, ExtendedKeyUsageOID.SERVER_AUTH),
            (anna, ExtendedKeyUsageOID.CLIENT_AUTH),
        ):
            assert list(certificate.extensions.get_extension_for_class(x509.ExtendedKeyUsage).value) == [
                usage
            ]
            lasts = certificate.not_valid_after_utc - certificate.not_valid_before_utc
            assert lasts == timedelta(days=30, hours=1)
        assert anna.subject.rfc4514_string() == "CN=anna"

    def test_again_adds_clients_of_the_same_authority_and_overwrites_nothing(self, ring):
        before = content(ring)
        ended = tvist("keys", ring, "--operator", "anna", "--viewer", "otto", "--json")
        assert ended.returncode == 0, ended.stderr
        assert json.loads(ended.stdout)["roles"] == {"anna": "operator", "wall": "viewer", "otto": "viewer"}
        after = content(ring)
        assert {path for path in before if before[path] != after[path]} == {ring / "clients.toml"}
        assert (ring / "otto" / "authority.pem").read_bytes() == (ring / "authority.pem").read_bytes()

    @pytest.mark.parametrize(
        ("options", "code", "words"),
        [
            (("--operator", "wall"), 1, ["wall already has the role viewer"]),
            (
                ("--robot", "other", "--host", "localhost"),
                1,
                ["robot.pem belongs to ur5e", "not overwritten"],
            ),
            (
                ("--robot", "ur5e", "--host", "elsewhere"),
                1,
                ["robot.pem belongs to ur5e at 127.0.0.1, localhost"],
            ),
            (("--viewer", "../etc"), 2, ["client is '../etc'"]),
            (("--viewer", "authority.pem"), 2, ["client is 'authority.pem'"]),
            (("--viewer", "a", "--operator", "a"), 2, ["cannot be both operator and viewer"]),
            (("--host", "no host"), 2, ["host is 'no host'"]),
            (("--host", "999.1.1.1"), 2, ["host is '999.1.1.1'"]),
            (("--robot", "UR 5"), 2, ["robot is 'UR 5'"]),
            (("--days", "0"), 2, ["days is 0"]),
        ],
    )
    def test_what_cannot_be_is_said_and_changes_nothing(self, ring, options, code, words):
        before = content(ring)
        failed(tvist("keys", ring, "--viewer", "otto", *options), code, *words)
        assert content(ring) == before

    def test_the_first_time_it_needs_robot_and_host(self, tmp_path):
        failed(tvist("keys", tmp_path / "ring", "--operator", "anna"), 2, "--robot", "--host")
        assert not (tmp_path / "ring").exists()

    def test_without_the_authority_s_key_there_is_no_new_authority(self, ring):
        (ring / "authority.key").unlink()
        before = content(ring)
        failed(tvist("keys", ring, "--viewer", "otto"), 1, "authority.key", "put it back")
        assert content(ring) == before

    def test_a_folder_moved_away_is_made_anew(self, ring):
        (ring / "anna").rename(ring.parent / "old")
        assert tvist("keys", ring, "--operator", "anna").returncode == 0
        assert (ring / "anna" / "client.pem").read_bytes() != (
            ring.parent / "old" / "client.pem"
        ).read_bytes()
        assert (ring / "clients.toml").read_text().count("anna") == 1

    def test_a_name_that_was_left_out_is_not_let_in_again(self, ring):
        (ring / "clients.toml").write_text('"anna" = "operator"\n')
        before = content(ring)
        failed(tvist("keys", ring, "--operator", "wall"), 1, "wall", "use another name")
        assert content(ring) == before


class TestServing:
    @pytest.mark.parametrize("address", ["0.0.0.0:7447", "[::]:7447", "203.0.113.7:7447"])
    @pytest.mark.parametrize("file", [False, True])
    def test_beyond_this_machine_it_needs_security_or_a_word(self, tmp_path, address, file):
        endpoint = f"tcp/{address}"
        options = ("--listen", endpoint)
        if file:
            path = tmp_path / "robot.toml"
            path.write_text(f'listen = ["{endpoint}"]\n')
            options = ("--config", path)
        failed(tvist("serve", *options), 2, endpoint, "--security DIR", "--insecure")

    @pytest.mark.parametrize("file", [False, True])
    def test_with_that_word_it_listens_and_says_what_that_means(self, tmp_path, file):
        endpoint = free_endpoint().replace("127.0.0.1", "0.0.0.0")  # noqa: S104  that is the point
        path = tmp_path / "robot.toml"
        path.write_text("insecure = true\n")
        options = ("--clock", "lockstep", *(("--config", str(path)) if file else ("--insecure",)))
        with Served(*options, endpoint=endpoint) as served:
            assert f"anyone who can reach {endpoint} can move this robot" in served.said
            with socket.create_connection(("127.0.0.1", int(endpoint.rpartition(":")[2]))):
                pass

    def test_plain_tcp_does_not_go_with_security(self, ring):
        endpoint = free_endpoint()
        failed(
            tvist("serve", "--listen", endpoint, "--security", ring),
            2,
            endpoint,
            endpoint.replace("tcp/", "tls/"),
        )

    def test_nor_do_settings_in_the_endpoint_that_would_go_before_it(self, ring):
        endpoint = f"{free_tls_endpoint()}#enable_mtls=false"
        failed(tvist("serve", "--listen", endpoint, "--security", ring), 2, endpoint, "#")

    def test_security_and_insecure_exclude_each_other(self, ring):
        options = ("--listen", free_tls_endpoint(), "--security", ring, "--insecure")
        failed(tvist("serve", *options), 2, "security and insecure")

    @pytest.mark.parametrize("name", ["authority.pem", "robot.pem", "robot.key", "clients.toml"])
    @pytest.mark.parametrize("spoilt", [None, b"nonsense", b""])
    def test_a_file_that_is_not_there_or_not_what_it_should_be(self, ring, name, spoilt):
        (ring / name).unlink()
        if spoilt is not None:
            (ring / name).write_bytes(spoilt)
        failed(tvist("serve", "--listen", free_tls_endpoint(), "--security", ring), 2, str(ring))

    def test_another_authority_s_robot(self, ring, tmp_path):
        other = made(tmp_path / "other", "--operator", "anna")
        (ring / "authority.pem").write_bytes((other / "authority.pem").read_bytes())
        failed(
            tvist("serve", "--listen", free_tls_endpoint(), "--security", ring), 2, "no client would trust"
        )

    def test_a_robot_s_certificate_that_has_expired(self, ring, tmp_path):
        usage = ExtendedKeyUsageOID.SERVER_AUTH
        issuer = (ring / "authority.pem", ring / "authority.key")
        expired = forge(tmp_path / "expired", "ur5e", issuer=issuer, days=-1, usage=usage)
        (ring / "robot.pem").write_bytes((expired / "client.pem").read_bytes())
        (ring / "robot.key").write_bytes((expired / "client.key").read_bytes())
        failed(tvist("serve", "--listen", free_tls_endpoint(), "--security", ring), 2, "expired")

    def test_a_role_that_is_none(self, ring):
        (ring / "clients.toml").write_text('"anna" = "root"\n')
        failed(tvist("serve", "--listen", free_tls_endpoint(), "--security", ring), 2, "clients.toml", "root")

    def test_a_port_in_use_is_named_without_what_was_added_to_it(self, ring):
        endpoint = free_tls_endpoint()
        with socket.create_server(("127.0.0.1", int(endpoint.rpartition(":")[2]))):
            ended = tvist("serve", "--listen", endpoint, "--security", ring)
        failed(ended, 1, f"cannot listen on {endpoint}: the port is in use")


@pytest.mark.realtime
class TestProgram:
    @pytest.fixture(scope="class")
    @classmethod
    def robot(cls, tmp_path_factory):
        ring = made(tmp_path_factory.mktemp("keys") / "ring", "--operator", "anna", "--viewer", "wall")
        with Served("--security", str(ring), endpoint=free_tls_endpoint()) as served:
            yield served.endpoint, ring

    @pytest.fixture(scope="class")
    @classmethod
    def still(cls, robot):
        """Endpoint of one in lockstep, which no busy machine overloads."""
        options = ("--security", str(robot[1]), "--clock", "lockstep")
        with Served(*options, endpoint=free_tls_endpoint()) as served:
            yield served.endpoint

    @pytest.mark.parametrize(("name", "said"), [("anna", "no_control"), ("wall", "the role viewer")])
    def test_check(self, robot, still, name, said, capsys):
        endpoint, ring = still, robot[1]
        ended = tvist("check", endpoint, "--security", ring / name)
        assert ended.returncode == 0, ended.stderr
        assert said in ended.stdout
        assert check_alone(["check", endpoint, "--security", str(ring / name)]) == 0
        assert said in capsys.readouterr().out

    def test_move_watch_and_record(self, robot, tmp_path):
        endpoint, ring = robot
        assert tvist("move", "Q2", "--endpoint", endpoint, "--security", ring / "anna").returncode == 0
        watched = tvist("watch", endpoint, "--security", ring / "wall", "--seconds", "0.5", "--json")
        assert watched.returncode == 0, watched.stderr
        assert json.loads(watched.stdout.splitlines()[0])["type"] == "state"
        file = tmp_path / "seen.mcap"
        options = ("--endpoint", endpoint, "--security", ring / "wall", "--seconds", "0.5")
        assert tvist("log", "record", file, *options).returncode == 0
        assert file.stat().st_size > 1000

    @pytest.mark.parametrize("command", [("move", "Q1", "--endpoint"), ("identify",)])
    def test_a_viewer_s_key_moves_nothing(self, robot, command):
        endpoint, ring = robot
        failed(
            tvist(*command, endpoint, "--security", ring / "wall"),
            1,
            "may only watch: use an operator's certificate",
        )

    def test_an_endpoint_and_keys_that_do_not_go_together(self, robot, tmp_path):
        endpoint, ring = robot
        failed(tvist("check", endpoint), 1, endpoint, "give its folder")
        plain = endpoint.replace("tls/", "tcp/")
        failed(tvist("check", plain, "--security", ring / "anna"), 1, plain, "tls/<host>:<port>")
        failed(tvist("check", endpoint, "--security", tmp_path), 1, str(tmp_path), "tvist keys")


def test_the_how_to_works_as_it_stands(tmp_path):
    """Its commands, in their order; those that name this machine are run here."""
    text = (ROOT / "docs" / "how-to" / "secure-a-robot.md").read_text(encoding="utf-8")
    commands = [
        line
        for block in re.findall(r"```sh\n(.*?)```", text, re.DOTALL)
        for line in block.splitlines()
        if line
    ]
    endpoint = free_tls_endpoint()
    port = endpoint.rpartition(":")[2]
    serving, ran = None, []
    try:
        for command in commands:
            words = (
                command.partition("  #")[0].replace("7447", port).replace("robot.lab", "localhost").split()
            )
            assert words[0] in {"tvist", "python"}, command
            if words[0] == "tvist":
                words = [sys.executable, "-m", "tvist_cli", *words[1:]]
            elif words[0] == "python":
                words[0] = sys.executable
            if "serve" in words:
                serving = subprocess.Popen(words, cwd=tmp_path, stderr=subprocess.PIPE, text=True)
                line = serving.stderr.readline()
                while line and "listens on" not in line:
                    line = serving.stderr.readline()
                assert "listens on" in line
                continue
            ended = subprocess.run(
                words, cwd=tmp_path, capture_output=True, text=True, timeout=PATIENCE, check=False
            )
            assert ended.returncode == 0, (command, ended.stderr)
            ran.append(command)
    finally:
        if serving is not None:
            serving.terminate()
            serving.communicate(timeout=PATIENCE)
    assert len(ran) > 4
