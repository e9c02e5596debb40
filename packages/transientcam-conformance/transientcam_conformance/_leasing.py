"""The lease: one client in control, known to the others, and readers that are never blocked."""

from transientcam_conformance._device import API, HOLDER, Device
from transientcam_conformance._expecting import equal, expect

_LEASE = f"{API}/lease"
_ACQUISITION = f"{API}/acquisition"
_SHORT_S = 1.0
_NEXT = "the next holder"


def a_second_writer_learns_who_holds_the_lease(device: Device) -> None:
    """While a lease is held, changes without it are refused with 409, naming the holder."""
    with device.control(), device.as_another():
        change = {"running": device.read(_ACQUISITION)["running"]}
        refused = device.refusal(device.send("PUT", _ACQUISITION, json=change), 409, "lease-held")
        equal(refused.get("holder"), HOLDER, "`holder` in the problem")
        expect(refused.get("expires_in_s", 0.0) > 0.0, "the problem has no time of expiry")
        second = device.send("POST", _LEASE, json={"holder": "another client"})
        device.refusal(second, 409, "lease-held")


def watchers_are_never_blocked(device: Device) -> None:
    """Reading requires no lease, whichever client holds it."""
    with device.control(), device.as_another():
        for path in ("camera", "sequence", "acquisition"):
            device.read(f"{API}/{path}")
        held = device.read(_LEASE)
        equal((held["held"], held["holder"]), (True, HOLDER), "who holds the lease")
        expect("lease_id" not in held, "the lease's id is shown to other clients")


def the_holder_changes_things(device: Device) -> None:
    """Changes that carry the lease in Transientcam-Lease are done."""
    with device.control():
        body = {"running": device.read(_ACQUISITION)["running"]}
        device.document(device.send("PUT", _ACQUISITION, json=body))


def a_renewed_lease_lasts_on(device: Device) -> None:
    """PUT with the lease lets it last for its duration from then on."""
    with device.control():
        renewed = device.document(device.send("PUT", _LEASE, json={"duration_s": 1200.0}))
        expect(renewed["expires_in_s"] > 1000.0, "the lease is not renewed")


def a_lease_given_back_is_over(device: Device) -> None:
    """After DELETE every client may make changes again, and the former lease is refused."""
    with device.control(), device.as_another() as own:
        device.document(device.send("DELETE", _LEASE, headers=own))
        equal(device.read(_LEASE)["held"], False, "`held` after it was given back")
        change = {"running": device.read(_ACQUISITION)["running"]}
        late = device.send("PUT", _ACQUISITION, json=change, headers=own)
        device.refusal(late, 409, "lease-lost")
        device.document(device.send("PUT", _ACQUISITION, json=change))


def a_lease_that_is_not_renewed_lapses_and_the_light_goes_off(device: Device) -> None:
    """A lease that is not renewed lapses: capture and light stop, and streams get a notice."""
    with (
        device.control(),
        device.capturing(),
        device.stream("flags") as watcher,
        device.as_another() as own,
    ):
        terms = {"duration_s": _SHORT_S, "on_lapse": "stop"}
        device.document(device.send("PUT", _LEASE, json=terms, headers=own))
        details = watcher.notice("lease-changed").details
        found = details.get("change"), details.get("holder")
        equal(found, ("lapsed", HOLDER), "change and holder in the notice")
        equal(device.read(_LEASE)["held"], False, "`held` after the lease lapsed")
        device.refusal(device.send("PUT", _LEASE, headers=own), 409, "lease-lost")
        device.wait_until(
            lambda: device.read(_ACQUISITION)["state"] == "stopped",
            "the capture does not stop when the lease lapses",
        )
        _expect_dark(device, "after the lease lapsed")


def a_takeover_is_notified(device: Device) -> None:
    """A client that takes the lease over gets it, and a notice names the former holder."""
    with device.control(), device.stream("flags") as watcher, device.as_another() as own:
        terms = {"holder": _NEXT, "takeover": True, "on_lapse": "keep"}
        granted = device.document(device.send("POST", _LEASE, json=terms), status=201)
        device.hold(granted["lease_id"])
        device.refusal(device.send("PUT", _LEASE, headers=own), 409, "lease-lost")
        details = watcher.notice("lease-changed").details
        found = details.get("change"), details.get("holder"), details.get("from")
        equal(
            found, ("taken-over", _NEXT, HOLDER), "change, holder and former holder in the notice"
        )


def every_client_can_switch_the_light_off(device: Device) -> None:
    """safe-off stops the capture and the light, whichever client holds the lease."""
    with device.control(), device.as_another():
        stopped = device.document(device.send("POST", f"{_ACQUISITION}/safe-off"))
        equal(stopped["running"], False, "`running` after safe-off")
        _expect_dark(device, "after safe-off")


def _expect_dark(device: Device, when: str) -> None:
    status = device.camera["status"]
    expect(status is None or not status["light_on"], f"the light is on {when}")
