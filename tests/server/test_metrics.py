"""The page for Prometheus, read with the parser of its library."""

import contextlib
import urllib.request
from pathlib import Path

import pytest
from prometheus_client.parser import text_string_to_metric_families

from tvist_protocol.stream import Event, Telemetry
from tvist_server.gateways.base import GatewayError
from tvist_server.gateways.metrics import FIGURES, NAMES, Metrics, MetricsGateway, page, place

PAGE = Path(__file__).parents[2] / "docs" / "reference" / "generated" / "metrics.md"
COUNTS = {field: 7 for kind, field, _ in FIGURES["telemetry"] if kind == "counter"}
TELEMETRY = Telemetry(
    tick=1000, ticks_per_second=499.5, late_p50_us=50.0, late_p99_us=900.0, late_max_us=2000.0, load=0.13,
    overloaded=True, **COUNTS
)  # fmt: skip


def test_the_page_has_the_figures_of_a_robot_with_its_labels():
    with contextlib.closing(Metrics("0")) as metrics:
        gateway = metrics.add(MetricsGateway("hall-3", "left", lambda: None))
        gateway.publish("telemetry", TELEMETRY, b"")
        for _ in range(2):
            gateway.publish("event", Event(tick=1, kind="lease_lost", id=None, why="gone"), b"")
        with urllib.request.urlopen(metrics.page) as answer:  # noqa: S310  our own page
            text = answer.read().decode()
    families = {family.name: family for family in text_string_to_metric_families(text)}
    labels = {"namespace": "hall-3", "robot": "left"}
    (rate,) = families["tvist_ticks_per_second"].samples
    assert (rate.labels, rate.value) == (labels, 499.5)
    samples = families["tvist_tick_lateness_seconds"].samples
    lateness = {sample.labels["quantile"]: sample.value for sample in samples}
    assert lateness == pytest.approx({"0.5": 50e-6, "0.99": 900e-6, "1": 2e-3})
    (overloaded,) = families["tvist_overloaded"].samples
    assert (overloaded.labels, overloaded.value) == (labels, 1.0)
    (events,) = (sample for sample in families["tvist_events"].samples if sample.name.endswith("_total"))
    assert (events.labels, events.value) == ({**labels, "kind": "lease_lost"}, 2)
    fields = [field for figures in FIGURES.values() for _, field, _ in figures]
    assert {f"tvist_{NAMES.get(field, field)}" for field in fields} < set(families)


def test_the_reference_page_of_metrics_is_up_to_date():
    assert PAGE.read_text(encoding="utf-8") == page()


@pytest.mark.parametrize("address", ["", "here", "127.0.0.1:", "127.0.0.1:70000", "1.2.3.4:x"])
def test_an_invalid_address_is_refused_and_a_port_alone_means_loopback(address):
    with pytest.raises(GatewayError, match="must be ADDRESS:PORT"):
        place(address)
    assert (place("9447"), place("[::1]:9447")) == (("127.0.0.1", 9447), ("::1", 9447))
