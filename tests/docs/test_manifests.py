"""The files for containers of a fleet: Kubernetes' own schemas, and commands that the program understands."""

from pathlib import Path

import kubernetes_validate
import pytest
import yaml

from tvist_cli.main import application

DOCKER = Path(__file__).parents[2] / "docker"
KUBERNETES = list(yaml.safe_load_all((DOCKER / "kubernetes.yaml").read_text()))


def understood(words):
    """Let the parser take a command line as a container has it."""
    application(words[:1]).parse_args(words, exit_on_error=False, print_error=False)


def recorded(words, mounts):
    """Whether a command records into a volume such that it can start again and again."""
    places = [words[at + 1] for at, word in enumerate(words[:-1]) if word == "--record"]
    return len(places) == 1 and "--keep" in words and any(places[0].startswith(mount) for mount in mounts)


def test_every_recorder_starts_again_by_itself_into_a_volume():
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


def test_kubernetes_takes_every_resource():
    assert {document["kind"] for document in KUBERNETES} >= {"Deployment", "StatefulSet", "Service"}
    for document in KUBERNETES:
        kubernetes_validate.validate(document, "1.34", strict=True)


def test_its_commands_and_probes_are_the_programs():
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


def test_a_router_and_three_robots_are_composed():
    services = yaml.safe_load((DOCKER / "fleet.yaml").read_text())["services"]
    assert len(services) == 4
    for service in services.values():
        assert (service["read_only"], service["cap_drop"]) == (True, ["ALL"])
        understood(service["command"])
        understood(service["healthcheck"]["test"][2:])
    robots = [service["command"] for service in services.values() if service["command"][0] == "serve"]
    assert len({(words[words.index("--namespace") + 1], words[2]) for words in robots}) == 3


@pytest.mark.parametrize("file", ["fleet.yaml", "compose.yaml"])
def test_ports_are_published_on_this_machine_alone(file):
    services = yaml.safe_load((DOCKER / file).read_text())["services"]
    assert all(
        port.startswith("127.0.0.1:") for service in services.values() for port in service.get("ports", [])
    )
