"""Files for containers of a fleet: they match Kubernetes' schemas and have valid commands."""

from pathlib import Path

import kubernetes_validate
import pytest
import yaml

from tvist_cli.main import application

DOCKER = Path(__file__).parents[2] / "docker"
KUBERNETES = list(yaml.safe_load_all((DOCKER / "kubernetes.yaml").read_text()))


def understood(words):
    """Parse a command line of a container."""
    application(words[:1]).parse_args(words, exit_on_error=False, print_error=False)


def recorded(words, mounts):
    """Return whether a command records into a volume so that it can be restarted."""
    places = [words[at + 1] for at, word in enumerate(words[:-1]) if word == "--record"]
    return len(places) == 1 and "--keep" in words and any(places[0].startswith(mount) for mount in mounts)


def test_recorders_restart_and_record_into_a_volume():
    found = []
    for file in ("fleet.yaml", "compose.yaml"):
        for service in yaml.safe_load((DOCKER / file).read_text())["services"].values():
            words = service.get("command", [])
            if "--record" in words:
                mounts = [volume.partition(":")[2] for volume in service["volumes"]]
                found.append(service["restart"] == "unless-stopped" and recorded(words, mounts))
    (robots,) = (document for document in KUBERNETES if document["kind"] == "StatefulSet")
    (container,) = robots["spec"]["template"]["spec"]["containers"]
    claims = {claim["metadata"]["name"] for claim in robots["spec"]["volumeClaimTemplates"]}
    mounts = [mount["mountPath"] for mount in container["volumeMounts"] if mount["name"] in claims]
    words = [part for word in container["args"] for part in word.split("=", 1)]
    assert [*found, recorded(words, mounts)] == [True] * 5


def test_resources_match_the_schemas_of_kubernetes():
    assert {document["kind"] for document in KUBERNETES} >= {"Deployment", "StatefulSet", "Service"}
    for document in KUBERNETES:
        kubernetes_validate.validate(document, "1.34", strict=True)


def test_commands_and_probes_are_valid():
    commands = []
    for document in KUBERNETES:
        template = document["spec"].get("template", {"spec": {"containers": []}})
        for container in template["spec"]["containers"]:
            commands.append(container["args"])
            probes = [container[probe] for probe in container if probe.endswith("Probe")]
            commands += [probe["exec"]["command"][1:] for probe in probes]
    assert len(commands) == 6
    for words in commands:
        understood(words)


def test_fleet_has_a_router_and_three_robots():
    services = yaml.safe_load((DOCKER / "fleet.yaml").read_text())["services"]
    assert len(services) == 4
    for service in services.values():
        assert (service["read_only"], service["cap_drop"]) == (True, ["ALL"])
        understood(service["command"])
        understood(service["healthcheck"]["test"][2:])
    robots = [service["command"] for service in services.values() if service["command"][0] == "serve"]
    assert len({(words[words.index("--namespace") + 1], words[2]) for words in robots}) == 3


@pytest.mark.parametrize("file", ["fleet.yaml", "compose.yaml"])
def test_ports_are_published_on_the_local_machine_only(file):
    services = yaml.safe_load((DOCKER / file).read_text())["services"]
    ports = [port for service in services.values() for port in service.get("ports", [])]
    assert all(port.startswith("127.0.0.1:") for port in ports)
